#!/usr/bin/env bash
# Packages of this build: small, the same bytes when made twice, without a trace of the build folder, lintian finds no error, and the
# Depends that scripts/cmake/packages.cmake writes down cover every library that is linked.
#   package_test.sh BUILD
set -euo pipefail
build="$(cd "$1" && pwd)"
trap 'echo "package_test: line $LINENO failed"' ERR
failures=0
fail() {
  echo "$1"
  failures=$((failures + 1))
}

pack() {
  (cd "$build" && rm -f packages/*.deb && cpack -G DEB --config CPackConfig.cmake >packages.log 2>&1) || {
    cat "$build/packages.log"
    exit 1
  }
  (cd "$build/packages" && sha256sum ./*.deb)
}

# Names of the packages that PACKAGE depends on, sorted.
depends_of() {
  dpkg-deb -f "$1" Depends | tr ',' '\n' | sed 's/^ *//; s/ .*//' | sort
}

first="$(pack)"
sleep 1.1
second="$(pack)"
[ "$first" = "$second" ] || fail "made twice, the packages differ: $first / $second"

for package in "$build"/packages/*.deb; do
  name="$(basename "$package" | cut -d_ -f1)"
  [ "$(stat -c %s "$package")" -le $((3 << 20)) ] || fail "$name is larger than 3 MiB"
  root="$build/packages/root-$name"
  rm -rf "$root"
  dpkg-deb -x "$package" "$root"
  if grep -rlF "$(cd "$build/.." && pwd)/" "$root"; then fail "$name names the folder it was built in"; fi

  # dpkg-shlibdeps reads debian/control of the folder it stands in.
  mkdir -p "$root/debian"
  printf 'Source: vergence\n\nPackage: vergence\nArchitecture: any\n' >"$root/debian/control"
  programs="$(find "$root/usr/bin" "$root/usr/libexec" -type f -exec sh -c 'head -c4 "$1" | grep -q ELF && echo "$1"' _ {} \; 2>/dev/null || true)"
  # shellcheck disable=SC2086  # one word a program
  needed="$(cd "$root" && dpkg-shlibdeps -O $programs 2>/dev/null | sed 's/.*Depends=//' | tr ',' '\n' | sed 's/^ *//; s/ .*//' | sort)"
  declared="$(depends_of "$package")"
  # What files compiled together link more than files by themselves comes with the package of the same version.
  had="$declared"
  if grep -qx vergence <<<"$declared"; then had="$({ echo "$declared"; depends_of "$build"/packages/vergence_*.deb; } | sort -u)"; fi
  missing="$(comm -23 <(printf '%s\n' "$needed") <(printf '%s\n' "$had") | paste -sd' ')"
  spare="$(comm -13 <(printf '%s\n' "$needed" adduser vergence | sort) <(printf '%s\n' "$declared") | paste -sd' ')"
  [ -z "$missing" ] || fail "$name links what its Depends do not name: $missing"
  [ -z "$spare" ] || fail "$name depends on what it does not link: $spare"
  rm -rf "$root"

  if command -v lintian >/dev/null; then
    lintian --allow-root --fail-on error "$package" || fail "lintian finds errors in $name"
  else
    echo "not looked at by lintian, which is not installed"
  fi
done
exit "$((failures > 0))"
