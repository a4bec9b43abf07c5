#!/usr/bin/env bash
# What the unit waits for, hangs on and comes back from, and that the documents say nothing else. Needs no systemd.
#   service_dependencies_test.sh SOURCE
set -euo pipefail
source="$1"
unit="$source/packaging/vergence.service"
failures=0
wrong() {
  echo "wrong: $1"
  failures=$((failures + 1))
}
# Values of a key in all its lines, a word each; comments do not count.
words_of() {
  sed -n "s/^$1=//p" "$unit" | tr ' ' '\n'
}

# A folder that systemd makes is one whose disk it requires: a data disk at sessions would take the odometry with it.
[ "$(words_of StateDirectory)" = vergence ] || wrong "StateDirectory= names more than vergence: $(words_of StateDirectory | paste -sd' ')"
if grep -E '^(Requires|Requisite|BindsTo|PartOf|RequiresMountsFor)=' "$unit"; then wrong "the unit goes with another one"; fi
words_of After | grep -qx 'var-lib-vergence-sessions.mount' || wrong "a data disk may be mounted over a session that has begun"

# What a boot without an uplink waits for.
for target in network-online.target time-sync.target systemd-udev-settle.service systemd-time-wait-sync.service; do
  for key in After Wants Requires; do
    if words_of "$key" | grep -qx "$target"; then wrong "$key= names $target"; fi
  done
done

# SIGTERM from anybody ends with 143, which is a success: only `always` begins anew.
[ "$(words_of Restart)" = always ] || wrong "after a SIGTERM that was not systemd's the service stays dead"
[ -z "$(words_of RestartPreventExitStatus)" ] || wrong "some exit code is not tried again"

# In drop-ins that documents propose: the number of a port is nobody's for good.
if grep -nE 'dev-tty[A-Za-z]*[0-9]+\.device' -r "$source/docs"; then wrong "a document binds a unit to the number of a port"; fi
exit "$((failures > 0))"
