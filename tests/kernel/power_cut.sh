#!/bin/bash
# A power cut: a guest records onto an ext4 disk of its own, QEMU is killed, and a second guest opens what the disk holds.
#   power_cut.sh ended TEST_KERNEL       cut when the recorder has sealed its session and ended with 0: it must be whole
#   power_cut.sh recording TEST_KERNEL   cut in mid-recording: at most the last second may be lost
# What the guest's kernel has not been asked to bring to the disk is lost with its memory: it writes nothing by itself.
# Exit status: 0, 1; 77 if this machine cannot run the guest, or was late, which it says: then only what does not depend
# on time was judged.
set -euo pipefail
here=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")" && pwd)
case=$1 program=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/tankrig-power-cut.XXXXXX")
trap 'rm -rf "$work"' EXIT
truncate -s 512M "$work/disk"

guest() {   # guest WHAT ARGUMENT...: boots with the disk and runs power_cut_guest.sh
  "$here/rigvm.sh" -t 280 -l virtio_blk -l ext4 \
    -q "-drive file=$work/disk,if=virtio,format=raw,cache=unsafe -pidfile $work/pid" -- "$here/power_cut_guest.sh" "$@" 2>&1
}

cut_when() {   # cut_when PATTERN: kills QEMU at the first line that matches; the lines so far go to $work/said
  local line
  while IFS= read -r line; do
    printf '%s\n' "$line" >>"$work/said"
    if [[ $line =~ $1 ]]; then
      kill -9 "$(<"$work/pid")"
      cat >/dev/null
      return
    fi
  done
  return 1
}

"$here/rigvm.sh" -s || exit $?
case $case in
  ended)
    cut_when '^ended with 0$' < <(guest end "$program") || { cat "$work/said"; exit 1; }
    guest check "$program"
    ;;
  recording)
    seed=${TANKRIG_SEED:-1}
    RANDOM=$seed
    moment=$((2 + RANDOM % 3)).$((RANDOM % 10))
    echo "the supply goes after $moment s; TANKRIG_SEED=$seed"
    cut_when '^now$' < <(guest record "$program" "$moment") || { cat "$work/said"; exit 1; }
    late=$(grep '^skipped because the machine was late' "$work/said" | tail -1 || true)
    guest verify "$program" "$(grep '^handed over' "$work/said")" "$late"
    [[ -z $late ]] || { echo "$late"; exit 77; }
    ;;
esac
