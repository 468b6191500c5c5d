#!/bin/bash
# Runs a command on Debian's own PREEMPT_RT kernel in a virtual machine whose root is this machine's file system:
#   rigvm.sh [-k rt|std] [-c CPUS] [-i] [-l MODULE]... [-m MEM] [-t SECONDS] [-w FOLDER]... [-q 'QEMU OPTIONS'] [-v] -- COMMAND [ARG]...
#   rigvm.sh [-k rt|std] -s        prepares the kernel (once per machine, about 20 s) and runs nothing
# The guest holds vcan0; can0 <-> can1, two SJA1000 controllers on one bus, up at 1 Mbit/s; /dev/video0, vivid;
# /dev/video10, v4l2loopback; /dev/ttyS1 <-> /dev/ttyS2, two 16550s cross-wired. The command runs there as root, in the
# same folder, with the same environment. The root lies read-only under a tmpfs: writes last only below a -w FOLDER.
#   -i  time counts instructions (2 ns each), not seconds: latencies no longer depend on the host; one CPU only
#   -l  loads a kernel module too, e.g. rigcan
# Exit status: the command's; 77 if this machine cannot run the guest, with the reason in one line on stderr;
# 124 out of time; 125 the guest did not come to its end (its console is printed).
set -euo pipefail

here=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")" && pwd)
cache=${RIGVM_HOME:-${XDG_CACHE_HOME:-$HOME/.cache}/tankrig/rigvm}
kind=rt cpus=1 mem=1G limit=120 verbose=0 virtual=0 setup_only=0 extra=() rw=() modules=()
die() { echo "rigvm: $*" >&2; exit 125; }
skip() { echo "rigvm: skipped: $*" >&2; exit 77; }
say() { ((!verbose)) || echo "rigvm: $*" >&2; }

while getopts k:c:il:m:st:w:q:v opt; do
  case $opt in
    k) kind=$OPTARG ;; c) cpus=$OPTARG ;; i) virtual=1 ;; l) modules+=("$OPTARG") ;; m) mem=$OPTARG ;; s) setup_only=1 ;;
    t) limit=$OPTARG ;; w) rw+=("$(realpath -e "$OPTARG")") || die "no folder $OPTARG" ;; q) read -ra extra <<<"$OPTARG" ;;
    v) verbose=1 ;; *) exit 125 ;;
  esac
done
shift $((OPTIND - 1))
(($# || setup_only)) || { sed -n '2,12s/^# //p' "$0" >&2; exit 125; }
[[ $kind == rt || $kind == std ]] || die "-k rt or -k std"
((!virtual || cpus == 1)) || die "-i takes one CPU"

# ---- set-up: one at a time; a failure is remembered for ten minutes, so that a row of tests does not repeat it ------
kernel=$cache/$kind
mkdir -p "$cache" || skip "cannot write $cache"
exec 9>"$cache/lock"
flock -w 600 9 || skip "another set-up has held $cache/lock for ten minutes"
failure=$cache/$kind.failed
if ((!setup_only)) && [[ -n $(find "$failure" -mmin -10 2>/dev/null) ]]; then skip "$(<"$failure")"; fi
rm -f "$failure"
result=0
reason=$(setpriv --pdeathsig TERM "$here/rigvm_setup.sh" "$kind" "$kernel" 9>&-) || result=$?
((result != 3)) || die "$reason"
if ((result)); then
  echo "${reason:=set-up interrupted, see $kernel.log}" >"$failure"
  skip "$reason"
fi
exec 9>&-
((!setup_only)) || exit 0

# ---- one run --------------------------------------------------------------------------------------------------------
for stale in "${TMPDIR:-/tmp}"/rigvm.[0-9]*; do   # of runs that were killed
  owner=${stale##*/rigvm.}
  [[ ! -O $stale || -e /proc/${owner%%.*} ]] || rm -rf "$stale"
done
run=$(mktemp -d "${TMPDIR:-/tmp}/rigvm.$$.XXXXXX")
qemu=
# shellcheck disable=SC2317  # reached by the trap
finish() {
  [[ -z $qemu ]] || { kill "$qemu" 2>/dev/null && wait "$qemu"; } || true
  rm -rf "$run"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

p9=trans=virtio,version=9p2000.L,msize=512000
shares=(-virtfs "local,path=/,mount_tag=hostroot,security_model=none,readonly=on,multidevs=remap"
        -virtfs "local,path=$run,mount_tag=run,security_model=none")
{ export -p; printf 'cd %q\nexec' "$PWD"; printf ' %q' "$@"; echo; } >"$run/command"
{
  printf 'kernel=%q\nmodules=%q\nmount_folders() {\n:\n' "$kernel" "${modules[*]}"
  for i in "${!rw[@]}"; do printf 'mount -t 9p -o %s,cache=mmap rw%d %q\n' "$p9" "$i" "${rw[i]}"; done
  echo '}'
} >"$run/settings"
cp "$here/guest_start.sh" "$run/"
for i in "${!rw[@]}"; do
  shares+=(-virtfs "local,path=${rw[i]},mount_tag=rw$i,security_model=none,multidevs=remap")
done
mkfifo "$run/in"   # a standard input that never ends: at its end QEMU would shut the port that carries the output

# boot ACCELERATOR OPTION...: one guest, from start to end
boot() {
  say "kernel $(<"$kernel/release"), $*"
  setpriv --pdeathsig TERM timeout --foreground -k 5 "$limit" \
    qemu-system-x86_64 -nodefaults -no-user-config -display none -no-reboot -M q35 "$@" -smp "$cpus" -m "$mem" \
    -kernel "$kernel/vmlinux" -initrd "$kernel/initrd.cpio" \
    -append "console=ttyS0 quiet panic=-1 nokaslr mitigations=off random.trust_cpu=on" "${shares[@]}" \
    -chardev "file,id=console,path=$run/console" -device isa-serial,chardev=console,index=0 \
    -chardev "socket,id=wire1,path=$run/wire,server=on,wait=off" -device isa-serial,chardev=wire1,index=1 \
    -chardev "socket,id=wire2,path=$run/wire" -device isa-serial,chardev=wire2,index=2,irq=5 \
    -device virtio-serial -chardev stdio,id=out,signal=off -device virtserialport,chardev=out,name=out \
    -object can-bus,id=bus -device kvaser_pci,canbus=bus -device kvaser_pci,canbus=bus \
    "${extra[@]}" <>"$run/in" &
  qemu=$!
  status=0
  wait "$qemu" || status=$?
  qemu=
}

if ((virtual)); then
  boot -accel tcg,thread=single -cpu max -icount shift=1,sleep=off
else
  # /dev/kvm may open and still not run this kernel (a PVM host): ask the processor, and believe only a guest that came up.
  if [[ ${RIGVM_ACCEL:-kvm} == kvm && -w /dev/kvm ]] && grep -qwE 'vmx|svm' /proc/cpuinfo; then
    boot -accel kvm -cpu host
  fi
  [[ -e $run/ready ]] || boot -accel tcg,thread=multi -cpu max
fi

[[ ! -e $run/ready ]] || say "ready after $(<"$run/ready") s of the guest's time"
((!verbose)) || sed 's/^/rigvm: console: /' "$run/console" >&2
[[ ! -s $run/status ]] || exit "$(<"$run/status")"
((status != 124 && status != 137)) || { echo "rigvm: out of time ($limit s)" >&2; exit 124; }
[[ ! -e $run/console ]] || tail -40 "$run/console" >&2
die "the guest did not come to its end (qemu: $status)"
