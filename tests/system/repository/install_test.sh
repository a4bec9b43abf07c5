#!/usr/bin/env bash
# What `cmake --install` puts down is complete: the program runs from there, finds the checkerboard tool and drives an example.
#   install_test.sh BUILD
set -euo pipefail
build="$1"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

fail() {
  echo "$1"
  exit 1
}

cmake --install "$build" --prefix "$work/usr" --component program >"$work/log" 2>&1 || fail "$(cat "$work/log")"
program="$work/usr/bin/vergence"
"$program" --version || fail "the installed program does not run"
"$program" run "$work/usr/share/vergence/config/mock.yaml" --fast --duration 1 --quiet --out "$work/session" 2>"$work/err" ||
  [ "$?" -le 1 ] || fail "$(cat "$work/err")"
[ -f "$work/session/summary.json" ] || fail "the example left no session"
for file in lib/udev/rules.d/99-vergence.rules lib/systemd/system/vergence.service lib/sysctl.d/10-vergence.conf libexec/vergence/vergence-session; do
  [ -f "$work/usr/$file" ] || fail "$file is not installed"
done
if command -v help2man >/dev/null; then  # of the packages' build alone
  for command in $("$program" --help | sed -n '/^Subcommands:/,$s/^  \([a-z]*\) .*/\1/p') calibrate-target; do
    zcat "$work/usr/share/man/man1/vergence-$command.1.gz" | grep -q '^\.SH OPTIONS\|^\.SS "Options' || fail "$command has no man page"
  done
fi

status=0
"$program" calibrate convert "$work/session/calibration.yaml" "$work/camchain.yaml" 2>"$work/err" || status=$?
if [ "$status" -ne 2 ] || ! grep -q 'the package vergence-checkerboard' "$work/err"; then
  fail "without the tool: exit $status, $(cat "$work/err")"
fi
cmake --install "$build" --prefix "$work/usr" --component checkerboard >"$work/log" 2>&1 || fail "$(cat "$work/log")"
[ -x "$work/usr/libexec/vergence/vergence-checkerboard" ] || fail "the checkerboard tool is not installed"
"$program" calibrate convert "$work/session/calibration.yaml" "$work/camchain.yaml" || fail "the program does not find the tool it is installed with"
[ -s "$work/camchain.yaml" ] || fail "nothing was converted"
