#!/usr/bin/env bash
# Builds the Debian packages baudgate, baudgate-dds and baudgate-dev into build/deb, on a fresh Debian 12: installs what the
# build needs, and prints what lintian says. The programs are those of build/release, on which the tests run.
# usage: packaging/deb.sh            builds: the first time takes some minutes
#        packaging/deb.sh --twice    builds again elsewhere, from nothing and in another time zone: the bytes must be the same
#        packaging/deb.sh --arm64    as root: builds for arm64, in a bare root of its own, into build/deb-arm64
#        packaging/deb.sh --test [arm64]    as root: the packages are installed in a bare root, used, upgraded, removed, purged
#        packaging/deb.sh --test quick      the same for the gateway alone; .ci/run does this
# Version: that of CMakeLists.txt at its tag (v0.1.0); elsewhere 0.1.0~git, the number of the commit and its name.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

packages=(ca-certificates git dpkg-dev debhelper lintian)  # the rest is in packaging/debian/control
out=build/deb

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

# source_tree FOLDER: copies the files of git, with debian/ at the place for dpkg-buildpackage.
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

commit_date() { TZ=UTC git log -1 --format=%cd --date=format-local:%Y-%m-%d; }

# build_packages FOLDER [BUILD]: makes the packages beside FOLDER. BUILD contains the built preset `release`; without BUILD
# the preset is built below FOLDER.
build_packages() {
  source_tree "$1"
  if ! dpkg-checkbuilddeps "$1/debian/control" 2>/dev/null; then
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq update
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq build-dep -y --no-install-recommends "$(realpath "$1")" >/dev/null
  fi
  if ! (cd "$1" && env ${2:+BAUDGATE_BUILT="$2"} dpkg-buildpackage -b --no-sign) >"$1.log" 2>&1; then
    tail -n 30 "$1.log" >&2
    echo "deb.sh: all of it is in $1.log" >&2
    return 1
  fi
}

# build_for ARCH: builds with a cross compiler, in a root that also runs programs of ARCH: man pages need their --help.
build_for() {
  readonly base=build/cross-root.base root=build/cross-root
  . packaging/bare_root.sh
  install_packages debootstrap
  programs_of "$1"
  bare_root
  say "what the build for $1 needs"
  inside dpkg --add-architecture "$1"
  quiet inside apt-get -qq update
  quiet inside apt-get -qq install -y --no-install-recommends dpkg-dev "crossbuild-essential-$1"
  mkdir "$root/made"
  source_tree "$root/made/src"
  quiet inside apt-get -qq build-dep -y --no-install-recommends "-a$1" -Pcross,nocheck /made/src
  say "building the packages for $1: this takes some minutes"
  # The kernel runs the tools that CMake would otherwise run in an emulator.
  quiet inside sh -c "cd /made/src && BAUDGATE_CMAKE=-DCMAKE_CROSSCOMPILING_EMULATOR=/usr/bin/env \
    dpkg-buildpackage -b --no-sign -a$1 -Pcross,nocheck"
  mkdir -p "$out"
  cp "$root"/made/*.* "$out/"
}

as_root_only() { [ "$(id -u)" = 0 ] || { echo "deb.sh: debootstrap and chroot need root" >&2; exit 2; }; }

case ${1:-} in
  '' | --twice) ;;
  --arm64) as_root_only; out=build/deb-arm64 ;;
  --test)
    as_root_only
    native=$(dpkg --print-architecture)
    case ${2:-$native} in
      quick) exec packaging/deb_test.sh "$native" "$out" quick ;;
      "$native") exec packaging/deb_test.sh "$native" "$out" ;;
      *) exec packaging/deb_test.sh "$2" "$out-$2" ;;
    esac
    ;;
  *) sed -n '2,/^set /{/^#/s/^# //p}' "$0" >&2; exit 2 ;;
esac

install_packages
rm -rf "$out"
if [ "${1:-}" = --arm64 ]; then
  build_for arm64
else
  configure_product
  configure release -DBAUDGATE_DATE="$(commit_date)"
  build release baudgate_packaged
  say "packing"
  build_packages "$out/src" "$PWD/build/release"
fi
if [ "${1:-}" = --twice ]; then
  say "building them again: this takes some minutes"
  CCACHE_DISABLE=1 TZ=Pacific/Kiritimati LC_ALL=C build_packages "$out/again/elsewhere"
  for made in "$out"/*.deb; do
    cmp "$made" "$out/again/${made##*/}"
  done
  echo "the same bytes twice: $(cd "$out" && ls ./*.deb | wc -l) packages"
fi
say "lintian"
lintian --allow-root --fail-on error,warning "$out"/*.changes
ls -l "$out"/*.deb
