#!/usr/bin/env bash
# The units are as closed as docs/deployment.md says (systemd's own measure: at most 3.0 of 10), and what it starts names a session folder
# that does not exist yet.
#   service_test.sh PACKAGING
set -euo pipefail
packaging="$1"
if ! systemd-analyze security --help >/dev/null 2>&1; then
  echo "skipped: needs systemd-analyze: sudo apt install systemd"
  exit 77
fi
work="$(mktemp -d)"
disk="$work/disk"
trap 'umount "$disk" 2>/dev/null || true; rm -rf "$work"' EXIT

for unit in vergence.service vergence-ros2.service; do
  systemd-analyze security --offline=true --threshold=30 --no-pager "$packaging/$unit" | tail -n 1
done

# The starter with a program that prints its arguments, twice within a second: two folders.
sed "s|/usr/bin/vergence|echo|" "$packaging/vergence-session" >"$work/start"
export STATE_DIRECTORY="$work/state:$work/state/sessions"
for _ in 1 2 3; do
  folder="$(sh "$work/start" | sed -n 's/^run \/etc\/vergence\/rig.yaml --out //p')"
  case "$folder" in
    "$work"/state/sessions/20[0-9][0-9]-*) ;;
    *)
      echo "the session folder would be: $folder"
      exit 1
      ;;
  esac
  mkdir -p "$(dirname "$folder")"
  mkdir "$folder" || { echo "$folder is used twice"; exit 1; }
done

# A disk that is full or read-only ends no start: the program drives without it. Root may mount one.
mkdir "$disk"
export STATE_DIRECTORY="$disk"
for options in nr_inodes=1 ro; do
  mount -t tmpfs -o "$options" none "$disk" 2>/dev/null || continue
  sh "$work/start" | grep -q "^run /etc/vergence/rig.yaml --out $disk/sessions/20" || { echo "nothing is started on a disk with $options"; exit 1; }
  umount "$disk"
done
