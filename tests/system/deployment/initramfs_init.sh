#!/bin/busybox sh
# shellcheck shell=dash
# The first process of the machine's initial file system: loads what the disk needs, and hands over to what `init=` names.
b=/bin/busybox
$b mkdir -p /proc /dev /disk
$b mount -t proc none /proc
$b mount -t devtmpfs none /dev
while read -r module; do $b insmod "/modules/$module"; done </modules/order
next=/sbin/init
for word in $($b cat /proc/cmdline); do
  case $word in init=*) next=${word#init=} ;; esac
done
tries=0
until [ -b /dev/vda ] || [ "$tries" -ge 100 ]; do
  tries=$((tries + 1))
  $b sleep 0.1
done
# After a power cut the journal of the file system is replayed here.
$b mount -t ext4 -o rw /dev/vda /disk || $b poweroff -f
$b umount /proc
$b mount --move /dev /disk/dev
exec $b switch_root /disk "$next"
