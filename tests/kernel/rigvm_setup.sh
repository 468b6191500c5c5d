#!/bin/bash
# Prepares what rigvm.sh boots:  rigvm_setup.sh rt|std FOLDER.  Nothing to do if FOLDER holds it already.
# Debian's kernel (found by its metapackage) and its headers are downloaded and unpacked there; nothing is installed and
# no root is needed. Then v4l2loopback and rigcan are built, the kernel unpacked to an ELF, and an initramfs packed.
# Exit status: 0, 77 if it cannot be had here, 3 if rigcan is broken; the reason in one line on stdout. Log: FOLDER.log.
set -euo pipefail

here=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")" && pwd)
kind=$1 folder=$2
case $kind in rt) meta=linux-image-rt-amd64 ;; *) meta=linux-image-amd64 ;; esac
boot_modules="virtio_pci virtio_console 9pnet_virtio 9p overlay"
mark=$folder/release   # written last, or the folder is not whole

exec 3>&1   # for the reason
cannot() { echo "$*" >&3; exit 77; }

require_tools() {
  local missing=() t
  for t in qemu-system-x86_64:qemu-system-x86 busybox:busybox-static cpio:cpio modprobe:kmod xz:xz-utils ip:iproute2 \
    setpriv:util-linux make:make gcc:gcc; do
    PATH=$PATH:/sbin:/usr/sbin command -v "${t%:*}" >/dev/null || missing+=("${t#*:}")
  done
  ((!${#missing[@]})) || cannot "packages missing: ${missing[*]} (./run test --ci installs them where apt can)"
  busybox=$(command -v busybox)
  ! ldd "$busybox" >/dev/null 2>&1 || cannot "busybox is not busybox-static"
  export PATH=$PATH:/sbin:/usr/sbin
}

fetch() {  # fetch PACKAGE...: downloads into $work
  (cd "$work" && timeout 300 apt-get -qq download "$@")
}

depends() { apt-cache depends "$1" 2>/dev/null | sed -n "s/^ *Depends: \($2\)$/\1/p" | head -1; }

# The machine's package lists if they know the kernel that the archive still has; else lists of our own.
find_kernel() {
  export APT_CONFIG=$work/apt.conf
  echo 'APT::Sandbox::User "root"; Acquire::Retries "2"; Acquire::http::Timeout "20"; Acquire::https::Timeout "20";' >"$APT_CONFIG"
  release=$(depends "$meta" 'linux-image-[0-9].*') && release=${release#linux-image-}
  if [[ -z $release ]] || ! fetch "linux-image-$release"; then
    mkdir -p "$work"/apt/{lists,archives}/partial
    echo "Dir::State::lists \"$work/apt/lists\"; Dir::Cache \"$work/apt\";" >>"$APT_CONFIG"
    timeout 300 apt-get -qq -o APT::Update::Error-Mode=any update || cannot "apt-get cannot fetch package lists, to find $meta"
    release=$(depends "$meta" 'linux-image-[0-9].*') && release=${release#linux-image-}
    [[ -n $release ]] || cannot "no package $meta in the sources of apt"
    fetch "linux-image-$release" || cannot "apt-get cannot download linux-image-$release"
  fi
}

unpack() {  # unpack NAME FOLDER [TAR OPTION]...: a downloaded package
  local name=$1 to=$2
  shift 2
  mkdir -p "$to"
  dpkg-deb --fsys-tarfile "$work/$name"_*.deb | tar -x -C "$to" "$@"
}

build_module() {  # build_module FOLDER
  make -C "$new/src/usr/src/linux-headers-$release" M="$1" CC=gcc modules
  install -D -t "$new/lib/modules/$release/updates" "$1"/*.ko
}

build_modules() {
  local headers=linux-headers-$release common kbuild tree=$new/src m
  common=$(depends "$headers" 'linux-headers-.*-common.*')
  kbuild=$(depends "$headers" 'linux-kbuild-.*')
  fetch "$headers" "$common" "$kbuild" v4l2loopback-dkms || cannot "apt-get cannot download $headers or v4l2loopback-dkms"
  for m in "$headers" "$common" "$kbuild" v4l2loopback-dkms; do unpack "$m" "$tree"; done
  sed -i "s,/usr/src/,$tree/usr/src/," "$tree/usr/src/$headers/Makefile"
  build_module "$(echo "$tree"/usr/src/v4l2loopback-*)"
  cp -r "$here/rigcan" "$tree/rigcan"
  build_module "$tree/rigcan" &   # in the background, because `set -e` sleeps left of a ||
  wait $! || { echo "tests/kernel/rigcan does not compile, see $folder.log" >&3; exit 3; }
  rm -r "$tree"
}

# A plain ELF boots at once (PVH entry); an emulated processor takes seconds to unpack a bzImage.
unpack_kernel() {
  local image=$new/boot/vmlinuz-$release sectors offset
  sectors=$(od -An -tu1 -j $((0x1f1)) -N1 "$image")
  offset=$(od -An -tu4 -j $((0x248)) -N4 "$image")
  xz -dc --single-stream < <(tail -c +$(((sectors + 1) * 512 + offset + 1)) "$image") >"$new/vmlinux"
}

make_initramfs() {
  local d=$new/initrd m file
  mkdir -p "$d/bin" "$d/modules"
  cp "$busybox" "$d/bin/busybox"
  for m in $boot_modules; do
    modprobe -d "$new" -S "$release" --show-depends "$m" | while read -r _ file _; do
      [[ -e $d/modules/${file##*/} ]] || { cp "$file" "$d/modules/"; echo "${file##*/}" >>"$d/modules/order"; }
    done
  done
  install -m 755 "$here/guest_init.sh" "$d/init"
  (cd "$d" && find . | cpio -o -H newc --quiet) >"$new/initrd.cpio"
  rm -r "$d"
}

prepare() {
  require_tools
  [[ -n $(command -v apt-get) && -n $(command -v dpkg-deb) ]] || cannot "not a Debian system: no apt-get, no dpkg-deb"
  (($(df --output=avail -k "$work" | tail -1) > 1000000)) || cannot "less than 1 GB free in ${folder%/*}"
  find_kernel
  # Only what a virtual machine can meet: a third of the modules.
  unpack "linux-image-$release" "$new" --exclude='*/drivers/gpu' --exclude='*/drivers/net/ethernet' \
    --exclude='*/drivers/net/wireless' --exclude='*/drivers/infiniband' --exclude='*/drivers/scsi' --exclude='*/kernel/sound'
  build_modules
  depmod -b "$new" -F "$new/boot/System.map-$release" "$release"
  unpack_kernel
  make_initramfs
  echo "$release" >"$new/release"
  echo "$version" >"$new/version"
}

[[ $(uname -m) == x86_64 ]] || cannot "the guest is x86_64, this machine $(uname -m)"
version=$(cat "$0" "$here/guest_init.sh" "$here"/rigcan/{Makefile,rigcan.c} | cksum)   # another set-up, another folder
if [[ -e $mark && $(cat "$folder/version" 2>/dev/null) == "$version" ]]; then
  require_tools
  exit 0
fi

work=$folder.work
new=$work/new
trap 'kill ${job-} 2>/dev/null || true; rm -rf "$work"' EXIT
trap 'exit 143' TERM
rm -rf "$work"
mkdir -p "$new"
exec >"$folder.log" 2>&1 </dev/null
prepare &
job=$!
wait "$job" || case $? in 3) exit 3 ;; 77) exit 77 ;; *) cannot "set-up failed, see $folder.log" ;; esac
job=
rm -rf "$folder"
mv "$new" "$folder"
