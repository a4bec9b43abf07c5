#!/usr/bin/env bash
# The service under a systemd of its own: it begins without a disk that does not come, writes to one that is there, outlives one that
# goes, begins anew after a SIGTERM that is not systemd's, and stays away after `systemctl stop`. In place of the program something
# that writes a file into its session.
#   service_and_disk.sh PACKAGING      as root in the kernel of the rigs (tests/rigs/run-in-kernel), whose changes vanish
# Exit: 0, 1 something is wrong, 77 there is no systemd.
set -euo pipefail
packaging="$1"
sessions=/var/lib/vergence/sessions
mount_unit=var-lib-vergence-sessions.mount
own=/etc/systemd/system

begin() {
  if [ ! -x /usr/lib/systemd/systemd ] || ! command -v python3 >/dev/null; then
    echo "skipped: systemd or python3 is not installed"
    exit 77
  fi
  echo 'vergence:x:990:990::/var/lib/vergence:/usr/sbin/nologin' >>/etc/passwd
  echo 'vergence:x:990:' >>/etc/group
  mkdir -p /etc/vergence /usr/libexec/vergence "$own"
  touch /etc/vergence/rig.yaml
  cp "$packaging/vergence.service" "$own"
  install -m 755 "$packaging/vergence-session" /usr/libexec/vergence
  cat >/usr/bin/vergence <<'PROGRAM'
#!/usr/bin/python3
import os, signal, socket, sys, time
signal.signal(signal.SIGTERM, lambda *_: os._exit(143))
folder = sys.argv[sys.argv.index("--out") + 1]
os.makedirs(folder)
manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
while True:
    try:
        open(os.path.join(folder, "line"), "w").close()
    except OSError:
        pass  # the disk has gone
    manager.sendto(b"READY=1\nWATCHDOG=1", os.environ["NOTIFY_SOCKET"])
    time.sleep(0.5)
PROGRAM
  chmod 755 /usr/bin/vergence
  # A disk that the board does not have; nofail,x-systemd.device-timeout=5s of fstab become this.
  printf '[Unit]\nDefaultDependencies=no\n[Mount]\nWhat=/dev/missing1\nWhere=%s\n' "$sessions" >"$own/$mount_unit"
  printf '[Unit]\nJobTimeoutSec=5\n' >"$own/dev-missing1.device"
  printf '[Unit]\nDefaultDependencies=no\nSuccessAction=exit-force\nFailureAction=exit-force\n[Service]\nStandardOutput=append:%s\nStandardError=inherit\nExecStart=bash %s %s inside\n' \
    "$PWD/log" "$(realpath "$0")" "$packaging" >"$own/examination.service"
  printf '[Unit]\nDefaultDependencies=no\nWants=examination.service systemd-journald.service\n' >"$own/examination.target"
  rm -f log
  # The word container: nothing of the machine below is systemd's to set.
  container=other unshare --fork --pid --mount --mount-proc bash -c 'mount -t cgroup2 none /sys/fs/cgroup && mount --make-rshared / &&
    exec /usr/lib/systemd/systemd --unit=examination.target --log-target=null --show-status=0' && status=0 || status=$?
  cat log
  exit "$status"
}

failures=0
need() {  # sentence, command
  local sentence="$1"
  shift
  "$@" || {
    echo "wrong: $sentence: $(systemctl show vergence -p ActiveState,SubState,Result,NRestarts | paste -sd' ')"
    journalctl -u vergence -o cat --no-pager -n 10
    failures=$((failures + 1))
  }
}
# shellcheck disable=SC2317  # called by need
active() { systemctl is-active --quiet vergence; }
# shellcheck disable=SC2317  # called by need
writes() {  # the newest session below a folder is written now
  local before
  before="$(date +%s)"
  sleep 3
  [ -n "$(find "$1" -name line -newermt "@$before")" ]
}
disk() {
  mount -t tmpfs none "$sessions"
  chown vergence: "$sessions"
}

examine() {
  systemctl start --no-block "$mount_unit"
  need "it does not begin without the disk" timeout 60 systemctl start vergence
  need "it does not write without the disk" writes /var/lib/vergence
  systemctl stop vergence

  mkdir -p "$sessions"
  disk
  need "it does not begin with the disk" timeout 60 systemctl start vergence
  need "it does not write to the disk" writes "$sessions"
  systemctl stop "$mount_unit" || umount --lazy "$sessions"
  sleep 1
  need "it went with the disk" active

  systemctl kill -s TERM vergence
  sleep 12
  need "it is dead after a SIGTERM" active
  systemctl stop vergence
  sleep 8
  if active; then need "it came back from systemctl stop" false; fi
  echo "$failures wrong"
  exit "$((failures > 0))"
}

if [ "${2:-}" = inside ]; then examine; else begin; fi
