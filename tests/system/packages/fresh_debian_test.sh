#!/usr/bin/env bash
# Installs, upgrades, removes and purges the package in a minimal Debian 12 that mmdebstrap makes for it and throws away.
#   fresh_debian_test.sh FOLDER_OF_PACKAGES
# Exit: 0, 1 something is wrong, 77 no such Debian can be made here.
set -euo pipefail
packages="$(cd "$1" && pwd)"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
package="$(ls "$packages"/vergence_*_"$(dpkg --print-architecture)".deb)"
for tool in mmdebstrap dpkg-deb; do
  command -v "$tool" >/dev/null || {
    echo "skipped: needs $tool: sudo apt install mmdebstrap dpkg"
    exit 77
  }
done
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
chmod 755 "$work"

# The same package with a higher version, for the upgrade.
dpkg-deb -R "$package" "$work/newer"
sed -i 's/^Version: .*/&+upgrade/' "$work/newer/DEBIAN/control"
dpkg-deb --root-owner-group -b "$work/newer" "$work/newer.deb" >/dev/null
cp "$package" "$work/vergence.deb"
cp "$here/in_fresh_debian.sh" "$work/steps"
chmod 755 "$work/steps"

# $1 of a hook is the folder of the new Debian.
# shellcheck disable=SC2016
setsid --wait mmdebstrap --variant=minbase --customize-hook="copy-in $work/vergence.deb $work/newer.deb $work/steps /srv" \
  --customize-hook='if chroot "$1" sh /srv/steps; then echo passed; else echo failed; fi >"'"$work"'/verdict"; cat "$1/srv/log"' \
  bookworm /dev/null >"$work/log" 2>&1 </dev/null || true
grep -E '^(step|wrong|figure): ' "$work/log" || true
case "$(cat "$work/verdict" 2>/dev/null)" in
  passed) ;;
  failed) tail -n 40 "$work/log"; exit 1 ;;
  *)
    echo "skipped: mmdebstrap cannot make a Debian here: $(grep -m1 '^E: ' "$work/log" || tail -n 1 "$work/log")"
    exit 77
    ;;
esac
