#!/usr/bin/env bash
# The scripts refuse what makes no sense with exit 2 and one message that names it, before anything is built or written.
#   scripts_test.sh SOURCE
set -euo pipefail
source="$1"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir empty
failures=0

expect_refusal() {  # words that the message holds, then the command
  local words="$1" status=0
  shift
  "$@" </dev/null >out 2>err || status=$?
  if [ "$status" -ne 2 ] || ! grep -qF -- "$words" err || [ "$(wc -l <err)" -ne 1 ]; then
    echo "expected exit 2 and one line with '$words' from: $*; exit $status, stderr:"
    cat err
    failures=$((failures + 1))
  fi
}

expect_refusal "$work/nowhere is not a folder" "$source/scripts/demo" nowhere
expect_refusal "$work/empty is neither KITTI" "$source/scripts/demo" empty
expect_refusal "usage: scripts/setup [program" "$source/scripts/setup" everything
expect_refusal "usage: scripts/setup [program" "$source/scripts/setup" tests slow
expect_refusal "--tier takes default" "$source/scripts/test" --tier slow
expect_refusal "takes arm64 or armhf" "$source/scripts/cross" riscv64
expect_refusal "takes arm64 or armhf" "$source/scripts/sysroot" arm64 everything
expect_refusal "ten is neither seconds nor a number of inputs" "$source/scripts/fuzz" ten
expect_refusal "takes subset, asan or tsan" "$source/scripts/sanitize" everything
expect_refusal "usage: scripts/deployment-test [--keep" "$source/scripts/deployment-test" arm64
[ -z "$(find . -mindepth 1 -not -name empty -not -name out -not -name err)" ] || { echo "a script left files behind"; failures=$((failures + 1)); }

# A package stands in one list, and each line names one as Debian does.
lists="$(cat "$source"/scripts/packages/*.txt | sed 's/#.*//' | tr -d ' ' | sed '/^$/d')"
twice="$(printf '%s\n' "$lists" | sort | uniq -d)"
odd="$(printf '%s\n' "$lists" | grep -vxE '[a-z0-9][a-z0-9+.-]+' || true)"
if [ -n "$twice$odd" ]; then
  echo "package lists: listed twice: $twice; no package name: $odd"
  failures=$((failures + 1))
fi

# A name that no test has is a mistake, not a success.
silent="$(grep -nE '^ *ctest ' "$source"/scripts/{test,sanitize,cross} | grep -vF -- --no-tests=error || true)"
if [ -n "$silent" ]; then
  echo "ctest without --no-tests=error: $silent"
  failures=$((failures + 1))
fi

if command -v shellcheck >/dev/null; then
  shellcheck "$source"/scripts/{setup,demo,test,bench,cross,sysroot,deployment-test,fuzz,sanitize} "$source/.ci/run" "$source"/tests/system/{repository,packages,deployment}/*.sh \
    "$source/packaging/vergence-session" "$source"/packaging/debian/{postinst,prerm,postrm} || failures=$((failures + 1))
  (cd "$source/tests/rigs" && shellcheck -x build-kernel build-qemu run-in-kernel run-in-qemu init-in-kernel ./*.sh) ||
    failures=$((failures + 1))
fi
exit "$((failures > 0))"
