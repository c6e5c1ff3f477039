#!/usr/bin/env bash
# Builds the Debian packages baudgate, baudgate-dds and baudgate-dev into build/deb, on a fresh Debian 12: installs what the
# build needs, and says what lintian says.
# usage: packaging/deb.sh            builds: the first time takes some minutes
#        packaging/deb.sh --twice    builds twice, elsewhere and in another time zone: the same bytes have to come out
#        packaging/deb.sh --test     as root: what is in build/deb is installed in a bare root, used, upgraded, removed, purged
# Version: that of CMakeLists.txt at its tag (v0.1.0); elsewhere 0.1.0~git, the number of the commit and its name.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

packages=(ca-certificates git dpkg-dev debhelper lintian)  # the rest is in packaging/debian/control
readonly out=build/deb

git() { command git -c safe.directory='*' "$@"; }

version() {
  local version
  version=$(sed -n 's/^project(baudgate VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
  if [ "$(git tag --points-at HEAD "v$version")" = "v$version" ] && git diff --quiet HEAD; then
    echo "$version"
  else
    echo "$version~git$(git rev-list --count HEAD).$(git rev-parse --short=8 HEAD)$(git diff --quiet HEAD || echo .changed)"
  fi
}

# source_tree FOLDER: what git knows, with debian/ where dpkg-buildpackage wants it.
source_tree() {
  mkdir -p "$1"
  git ls-files -z | xargs -0 cp --parents -P -t "$1"
  cp -r packaging/debian "$1/debian"
  cat >"$1/debian/changelog" <<END
baudgate ($(version)) bookworm; urgency=medium

  * Commit $(git rev-parse --short=8 HEAD). What is new: /usr/share/doc/baudgate/CHANGELOG.md

 -- $(sed -n 's/^Maintainer: //p' packaging/debian/control)  $(date -u -R -d "@$(git log -1 --format=%ct)")
END
}

# build_packages FOLDER: the packages appear beside it.
build_packages() {
  source_tree "$1"
  if ! dpkg-checkbuilddeps "$1/debian/control" 2>/dev/null; then
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq update
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq build-dep -y --no-install-recommends "$(realpath "$1")" >/dev/null
  fi
  if ! (cd "$1" && dpkg-buildpackage -b --no-sign) >"$1.log" 2>&1; then
    tail -n 30 "$1.log" >&2
    echo "deb.sh: all of it is in $1.log" >&2
    return 1
  fi
}

case ${1:-} in
  '' | --twice) ;;
  --test) exec packaging/deb_test.sh ;;
  *) sed -n '2,/^set /{/^#/s/^# //p}' "$0" >&2; exit 2 ;;
esac

install_packages
rm -rf "$out"
say "building the packages: this takes some minutes"
build_packages "$out/src"
if [ "${1:-}" = --twice ]; then
  say "building them again"
  TZ=Pacific/Kiritimati LC_ALL=C build_packages "$out/again/elsewhere"
  for made in "$out"/*.deb; do
    cmp "$made" "$out/again/${made##*/}"
  done
  echo "the same bytes twice: $(cd "$out" && ls ./*.deb | wc -l) packages"
fi
say "lintian"
lintian --allow-root --fail-on error,warning "$out"/*.changes
ls -l "$out"/*.deb
