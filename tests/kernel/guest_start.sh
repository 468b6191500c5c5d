#!/bin/bash
# The guest's second program, on its full root: interfaces up, then the command; output through a virtio port, exit
# status through a file, and the end by a reset, which QEMU is told to take as its own end.
exec </dev/null >/dev/ttyS0 2>&1
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
kernel='' modules=''
# shellcheck source=/dev/null
. /run/rigvm/settings   # sets these, and mount_folders
mkdir -p /dev/shm /dev/pts /lib/modules
mount -t tmpfs shm /dev/shm
mount -t devpts devpts /dev/pts
mount --bind "$kernel/lib/modules" /lib/modules
mount_folders
hostname rigvm
ip link set lo up
modprobe -a vcan can-raw kvaser_pci
modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0
modprobe -q v4l2loopback video_nr=10 card_label=loopback exclusive_caps=1
ip link add vcan0 type vcan
ip link set vcan0 up
for c in can0 can1; do ip link set "$c" up txqueuelen 1000 type can bitrate 1000000 restart-ms 100; done

port=$(grep -lx out /sys/class/virtio-ports/*/name)   # its number follows the order of the devices
port=${port%/name}
read -r up _ </proc/uptime
echo "$up" >/run/rigvm/ready
{ for m in $modules; do modprobe "$m" || exit 125; done; bash /run/rigvm/command; } 2>&1 | cat >"/dev/${port##*/}"
echo "${PIPESTATUS[0]}" >/run/rigvm/status
sync
echo b >/proc/sysrq-trigger
sleep 60
