#!/usr/bin/env bash
# The scripts refuse what makes no sense with exit 2 and one sentence that names it, before anything is built or written.
#   scripts_test.sh SOURCE
set -euo pipefail
source="$1"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir empty
failures=0

expect_refusal() {  # words that the sentence holds, then the command
  local words="$1" status=0
  shift
  "$@" </dev/null >out 2>err || status=$?
  if [ "$status" -ne 2 ] || ! grep -qF "$words" err || [ "$(wc -l <err)" -ne 1 ]; then
    echo "expected exit 2 and one line with '$words' from: $*; exit $status, stderr:"
    cat err
    failures=$((failures + 1))
  fi
}

expect_refusal "$work/nowhere is not a folder" "$source/scripts/demo" nowhere
expect_refusal "$work/empty is neither KITTI" "$source/scripts/demo" empty
[ -z "$(find . -mindepth 1 -not -name empty -not -name out -not -name err)" ] || { echo "a script left files behind"; failures=$((failures + 1)); }

if command -v shellcheck >/dev/null; then
  shellcheck "$source"/scripts/{setup,demo,test,bench} "$source/.ci/run" "$source"/tests/system/house/*.sh || failures=$((failures + 1))
  (cd "$source/tests/rigs" && shellcheck -x build-kernel build-qemu run-in-kernel run-in-qemu init-in-kernel check ./*.sh) ||
    failures=$((failures + 1))
fi
exit "$((failures > 0))"
