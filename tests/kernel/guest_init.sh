#!/bin/busybox sh
# shellcheck shell=dash
# The guest's first program, in its initramfs: this machine's root (9p, read-only) under a tmpfs becomes the root.
b=/bin/busybox
p9=trans=virtio,version=9p2000.L,msize=512000
$b mkdir -p /proc /sys /dev /low /top /root
$b mount -t proc p /proc
$b mount -t sysfs s /sys
$b mount -t devtmpfs d /dev
for m in $($b cat /modules/order); do $b insmod "/modules/$m"; done
$b mount -t 9p -o ro,$p9,cache=loose hostroot /low
$b mount -t tmpfs t /top
$b mkdir /top/up /top/work
$b mount -t overlay -o lowerdir=/low,upperdir=/top/up,workdir=/top/work o /root
for d in proc sys dev; do $b mkdir -p /root/$d; $b mount --move /$d /root/$d; done
$b mount -t tmpfs r /root/run
$b mkdir /root/run/rigvm
$b mount -t 9p -o $p9,cache=none run /root/run/rigvm
exec $b switch_root /root /bin/bash /run/rigvm/guest_start.sh
