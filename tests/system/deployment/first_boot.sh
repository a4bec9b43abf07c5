#!/bin/bash
# The first process of the first boot: installs what was only unpacked, as debootstrap's second stage does, and switches off.
PATH=/usr/sbin:/usr/bin:/sbin:/bin
export PATH DEBIAN_FRONTEND=noninteractive DEBCONF_NONINTERACTIVE_SEEN=true LC_ALL=C HOME=/root
exec </dev/console >/dev/console 2>&1

finish() {
  echo "first boot: $1"
  sync
  mount -o remount,ro /
  busybox poweroff -f
}
trap 'finish failed' EXIT
set -eu

mount -t proc none /proc
mount -t sysfs none /sys
mount -t tmpfs none /run
mount -t tmpfs none /tmp
find / -xdev -mindepth 1 -maxdepth 1 ! -name dev ! -name proc ! -name sys ! -name run ! -name tmp -exec chown -R 0:0 {} +
mkdir -p /var/lib/dpkg/info /var/lib/dpkg/updates
touch /var/lib/dpkg/status /var/lib/dpkg/available
ln -sf mawk /usr/bin/awk
cd /var/cache/apt/archives
install="dpkg --force-depends --force-confold --force-unsafe-io"
# What the scripts of all the others use.
for package in base-passwd base-files dpkg libc6 perl-base mawk debconf; do
  $install --install "$package"_*.deb
done
$install --unpack ./*.deb
$install --configure --pending
rm -f ./*.deb
dpkg --audit

echo vergence-board >/etc/hostname
echo '/dev/vda / ext4 defaults 0 1' >/etc/fstab
passwd -d root
mkdir -p /var/log/journal
# A shell of root's on the second console, which whoever started the machine talks to.
cat >/etc/systemd/system/rig-shell.service <<'UNIT'
[Unit]
Description=Shell on hvc0
BindsTo=dev-hvc0.device
After=dev-hvc0.device
[Service]
ExecStart=/bin/dash
StandardInput=tty-force
StandardOutput=tty
StandardError=tty
TTYPath=/dev/hvc0
Environment=HOME=/root PS1= PS2= TERM=dumb
Restart=always
[Install]
WantedBy=dev-hvc0.device
UNIT
systemctl enable rig-shell.service
# Two webcams by the kernel's own test driver.
echo vivid >/etc/modules-load.d/cameras.conf
echo 'options vivid n_devs=2 node_types=0x1,0x1' >/etc/modprobe.d/cameras.conf
trap - EXIT
finish "done"
