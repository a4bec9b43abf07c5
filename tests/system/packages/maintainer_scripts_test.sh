#!/usr/bin/env bash
# The package's scripts where sessions are a disk of their own: purging gets by with a disk that is mounted and keeps what is on it,
# installing gets by with one that is not there. Everything below a folder of the test's, disks by tmpfs in a user namespace of its own.
#   maintainer_scripts_test.sh PACKAGING
# Exit: 0, 1 something is wrong, 77 nothing may be mounted here.
set -euo pipefail
if [ "${2:-}" != inside ]; then
  unshare --user --map-root-user --mount true 2>/dev/null || {
    echo "skipped: no user namespace here"
    exit 77
  }
  exec unshare --user --map-root-user --mount bash "$0" "$1" inside
fi
scripts="$1/debian"
work="$(mktemp -d)"
trap 'clear; rm -rf "$work"' EXIT
failures=0
wrong() {
  echo "wrong: $1"
  failures=$((failures + 1))
}

# Users, systemd and udev are not the test's: commands that would touch them do nothing, install forgets whose the folders are.
mkdir "$work/bin"
for tool in getent adduser deluser systemctl udevadm; do
  printf '#!/bin/sh\n' >"$work/bin/$tool"
done
# shellcheck disable=SC2016
printf '#!/bin/sh\n[ "$1 $2 $3 $4 $5" = "-d -o vergence -g vergence" ] || exit 9\nshift 5\nexec /usr/bin/install -d "$@"\n' >"$work/bin/install"
chmod 755 "$work"/bin/*
export PATH="$work/bin:$PATH"
state="$work/var/lib/vergence"
for script in postinst postrm; do
  sed "s#/var/lib/vergence#$state#g; s#/etc/#$work/etc/#g; s#/run/#$work/run/#g" "$scripts/$script" >"$work/$script"
done

rig() {  # a state folder as a drive leaves it
  mkdir -p "$state/sessions" "$state/mock/empty"
  echo 1 >"$state/calibration_state.yaml"
  echo 1 >"$state/mock/calibration_state.yaml"
}
disk() {  # a disk at $1, as mke2fs leaves it
  mkdir -p "$1"
  mount -t tmpfs none "$1"
  mkdir "$1/lost+found"
}
purge() {  # $1: what is the case
  sh "$work/postrm" purge 2>"$work/said" || wrong "$1: purging failed: $(cat "$work/said")"
  if [ -e "$state/calibration_state.yaml" ] || [ -e "$state/mock" ]; then wrong "$1: purging left what the program learnt"; fi
}
clear() {
  for folder in sessions data .; do umount "$state/$folder" 2>/dev/null || true; done
  rm -rf "${work:?}/var"
}

rig
purge "without a disk"
[ ! -e "$state" ] || wrong "without a disk: purging left $(find "$state")"
clear

rig
disk "$state/sessions"
purge "an unused disk for sessions"
[ -d "$state/sessions/lost+found" ] || wrong "an unused disk for sessions: it has no lost+found any more"
clear

rig
disk "$state/sessions"
mkdir "$state/sessions/drive"
echo precious >"$state/sessions/drive/poses.csv"
purge "a disk with a drive"
[ -f "$state/sessions/drive/poses.csv" ] || wrong "a disk with a drive: it is gone"
clear

rig
disk "$state/sessions"
mount -o remount,ro "$state/sessions"
purge "a read-only disk"
clear

mkdir -p "$state"
disk "$state"
rig
disk "$state/data"
echo precious >"$state/data/file"
purge "the state folder a disk, and another one below it"
[ -d "$state/lost+found" ] || wrong "the state folder a disk: it has no lost+found any more"
[ -f "$state/data/file" ] || wrong "another disk below the state folder: what was on it is gone"
clear

configure() {  # $1: what is the case
  sh "$work/postinst" configure 2>"$work/said" || wrong "$1: installing failed: $(cat "$work/said")"
}
configure "nothing there"
[ "$(stat -c %a "$state/sessions")" = 750 ] || wrong "nothing there: sessions may be read by others"
rm -r "$state/sessions"
ln -s "$work/disk/that/is/not/there" "$state/sessions"
configure "a link to a disk that is not mounted"
mkdir "$work/other"
chmod 755 "$work/other"
ln -sfn "$work/other" "$state/sessions"
configure "a link to somebody's folder"
[ "$(stat -c %a "$work/other")" = 755 ] || wrong "a link to somebody's folder: it has become the package's"
rm "$state/sessions"
disk "$state/sessions"
mount -o remount,ro "$state/sessions"
configure "a read-only disk"
exit "$((failures > 0))"
