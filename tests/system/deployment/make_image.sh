#!/usr/bin/env bash
# A Debian 12 for arm64 with its own kernel, to be booted by qemu-system-aarch64, and with what a vergence package depends on:
# prints a folder with disk (ext4, 3 GB, sparse), kernel and initramfs.
#   make_image.sh PACKAGE.deb
# Made once (see docs/deployment.md) under ${XDG_CACHE_HOME:-~/.cache}/vergence and made again when the list of packages or this
# folder's files change. The packages are unpacked here and installed by the machine itself at its first boot, so that no foreign
# program runs on this one and nothing of it is changed.
# Exit: 0, 2 bad arguments, 77 cannot be made here (the message says why).
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"

if [ "$#" -ne 1 ] || [ ! -f "$1" ]; then
  echo "make_image: takes a package of vergence for arm64" >&2
  exit 2
fi
PATH="$PATH:/usr/sbin:/sbin"
for tool in qemu-system-aarch64 mmdebstrap mke2fs depmod cpio; do
  command -v "$tool" >/dev/null || {
    echo "make_image: $tool is not here: apt-get install qemu-system-arm mmdebstrap e2fsprogs kmod cpio" >&2
    exit 77
  }
done

depends="$(dpkg-deb -f "$1" Depends | sed 's/ *([^)]*)//g; s/, */,/g')"
packages="usr-is-merged,apt,systemd-sysv,udev,kmod,e2fsprogs,busybox-static,linux-image-arm64,$depends"
hash="$({ echo "$packages" && cat "$here/make_image.sh" "$here/first_boot.sh" "$here/initramfs_init.sh"; } | sha256sum | cut -c1-12)"
cache="${XDG_CACHE_HOME:-$HOME/.cache}/vergence"
folder="$cache/deployment-arm64-$hash"
mkdir -p "$cache"
exec 9>"$cache/deployment.lock"
flock 9
if [ -d "$folder" ]; then
  echo "$folder"
  exit 0
fi
work="$(mktemp -d "$cache/deployment-making.XXXXXX")"
trap 'rm -rf "$work"' EXIT
mkdir "$work/root" "$work/image"

say() {
  printf 'make_image: %s (%d s)\n' "$1" "$SECONDS" >&2
}
say "fetching and unpacking Debian 12 for arm64"
unpack() {
  setsid --wait mmdebstrap --variant=extract --architectures=arm64 --include='?essential' --include="$packages" \
    --hook-directory=/usr/share/mmdebstrap/hooks/merged-usr --skip=cleanup \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='path-exclude=/usr/share/man/*' \
    bookworm - "$@" 2>"$work/log" </dev/null | tar -x -C "$work/root" --exclude='./dev/*' --no-same-owner 2>/dev/null
}
if ! unpack && ! unpack http://deb.debian.org/debian; then
  cat "$work/log" >&2
  echo "make_image: mmdebstrap could not make it, its messages are above" >&2
  exit 77
fi

# The kernel is started from outside, with an initramfs of its own: its packages are not installed, their files are all it needs.
version="$(basename "$work/root/boot"/vmlinuz-* | sed 's/^vmlinuz-//')"
cp "$work/root/boot/vmlinuz-$version" "$work/image/kernel"
rm -f "$work/root/var/cache/apt/archives"/{linux-image,linux-base,initramfs-tools,klibc-utils,libklibc}*.deb
depmod -b "$work/root" "$version"
mkdir -p "$work/initial/bin" "$work/initial/modules"
cp "$work/root/bin/busybox" "$work/initial/bin/"
cp "$here/initramfs_init.sh" "$work/initial/init"
chmod 755 "$work/initial/init"
for module in virtio_pci virtio_blk ext4; do
  modprobe -d "$work/root" -S "$version" --show-depends "$module" | sed -n 's/^insmod \([^ ]*\).*/\1/p'
done | awk '!seen[$0]++' >"$work/order"
while read -r file; do
  cp "$file" "$work/initial/modules/"
  basename "$file"
done <"$work/order" >"$work/initial/modules/order"
(cd "$work/initial" && find . | cpio --quiet -o -H newc -R 0:0 | gzip -1) >"$work/image/initramfs"

say "writing the disk"
install -m 755 "$here/first_boot.sh" "$work/root/first_boot"
mke2fs -q -t ext4 -E root_owner=0:0 -d "$work/root" "$work/image/disk" 3G >&2 # it names a new file, quiet or not
rm -rf "$work/root"

say "first boot: packages are installed in the emulated machine"
timeout 1200 qemu-system-aarch64 -machine virt -cpu cortex-a72 -accel tcg,thread=multi -smp 2 -m 1G -nodefaults -display none -no-reboot \
  -serial "file:$work/console" -kernel "$work/image/kernel" -initrd "$work/image/initramfs" \
  -append "console=ttyAMA0 quiet panic=-1 init=/first_boot" -drive "file=$work/image/disk,if=virtio,format=raw,cache=unsafe" </dev/null >&2 || true
if ! grep -q '^first boot: done' "$work/console"; then
  tail -n 40 "$work/console" >&2
  echo "make_image: the first boot did not come to its end, the console's last lines are above" >&2
  exit 1
fi
cp "$work/console" "$work/image/first_boot.log"
find "$cache" -maxdepth 1 -name 'deployment-arm64-*' -exec rm -rf {} +
mv "$work/image" "$folder"
say "ready"
echo "$folder"
