#!/bin/sh
# Inside the fresh Debian, as root: /srv/vergence.deb and /srv/newer.deb. Says each step in /srv/log.
set -eu
exec >/srv/log 2>&1
export DEBIAN_FRONTEND=noninteractive
failures=0
wrong() {
  echo "wrong: $1"
  failures=$((failures + 1))
}
kept() {
  for file in /etc/vergence/rig.yaml /var/lib/vergence/calibration_state.yaml; do
    [ -f "$file" ] || wrong "$1 lost $file"
  done
}
installed_kb() {
  dpkg-query -W -f '${db:Status-Status} ${Installed-Size}\n' | awk '$1 == "installed" { sum += $2 } END { print sum }'
}
traces() {
  find / -xdev \( -path /proc -o -path /sys -o -path /srv -o -path /var/cache -o -path /var/log -o -path /var/lib/dpkg -o -path /var/lib/apt \) \
    -prune -o -name '*vergence*' -print
}

echo "step: install"
before="$(installed_kb)"
apt-get install -y --no-install-recommends /srv/vergence.deb
own="$(dpkg-query -W -f '${Installed-Size}' vergence)"
grown=$((($(installed_kb) - before - own) * 1024 / 1000000))
echo "figure: what the program depends on takes $grown MB, itself $((own * 1024 / 1000000)) MB"
[ "$grown" -le 60 ] || wrong "dependencies of more than 60 MB are installed"
vergence --version || wrong "the program does not run"
vergence run /usr/share/vergence/config/mock.yaml --fast --duration 1 --quiet --out /tmp/session || [ "$?" -le 1 ] || wrong "the example does not drive"
rm -r /tmp/session
id -nG vergence | grep -qw dialout || wrong "the user is not in dialout"
id -nG vergence | grep -qw video || wrong "the user is not in video"
[ "$(stat -c '%U %a' /var/lib/vergence/sessions)" = "vergence 750" ] || wrong "the state folder is not the user's"

echo "step: upgrade"
mkdir -p /etc/vergence
cp /usr/share/vergence/config/mock.yaml /etc/vergence/rig.yaml
echo kept >/var/lib/vergence/calibration_state.yaml
apt-get install -y --no-install-recommends /srv/newer.deb
dpkg-query -W -f '${Version}' vergence | grep -q upgrade || wrong "not upgraded"
kept "the upgrade"

echo "step: remove"
apt-get remove -y vergence
[ ! -e /usr/bin/vergence ] || wrong "the program is still there"
kept removing

echo "step: purge"
apt-get purge -y vergence
left="$(traces)"
[ -z "$left" ] || wrong "purging left $left"
if getent passwd vergence; then wrong "purging left the user"; fi

echo "step: purge with a recorded drive"
apt-get install -y --no-install-recommends /srv/vergence.deb
mkdir /var/lib/vergence/sessions/drive
echo precious >/var/lib/vergence/sessions/drive/poses.csv
apt-get purge -y vergence
[ -f /var/lib/vergence/sessions/drive/poses.csv ] || wrong "purging threw a recorded drive away"
[ "$failures" -eq 0 ]
