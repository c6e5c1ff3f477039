#!/usr/bin/env bash
# Checks how the sources are written: the English of comments and documents (packaging/prose.py), clang-format over all sources,
# clang-tidy (.clang-tidy) over those of the product; that each compiles alone, although CMake compiles several together; and the
# thread-safety marks of gateway/base/guarded.h.
#   packaging/lint.sh [BUILD_FOLDER]            all; another BUILD_FOLDER than build/release was configured by cmake
#   packaging/lint.sh [BUILD_FOLDER] --changed [COMMIT]   only what differs from COMMIT (main)
#   packaging/lint.sh [BUILD_FOLDER] --quick    format and English only: a quarter of a minute
#   packaging/lint.sh [BUILD_FOLDER] --alone [N]    that each source of the product compiles alone, and that what a mutex guards is
#                                               touched under it: minutes; packaging/test.sh runs it beside the tests
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh
install_packages "${lint_packages[@]}"
build=build/release
case "${1:-}" in
  '' | --*) ;;
  *) build=$1; shift ;;
esac
# --alone leaves the build as it is.
[ "$build" != build/release ] || [ "${1:-}" = --alone ] || configure_product
if [ ! -f "$build/compile_commands.json" ]; then
  echo "lint: $build/compile_commands.json is missing: cmake --preset ${build##*/}" >&2
  exit 2
fi

mkdir -p "$build/lint"
packaging/compile_commands.py "$build/compile_commands.json" >"$build/lint/compile_commands.json"

files() { git ls-files "$@"; }
if [ "${1:-}" = --changed ]; then
  base=${2:-main}
  files() { git diff --name-only --diff-filter=d "$base" -- "$@"; }
fi
# tidy [OPTION…]: the sources named on standard input. A header is looked at with the sources that include it.
tidy() {
  xargs -r -n 2 -P "$(nproc)" clang-tidy-14 -p "$build/lint" --quiet "$@" 2> >(grep -v 'warnings generated' >&2)
}
if [ "${1:-}" = --alone ]; then
  mapfile -t sources < <(files 'config/*.cpp' 'gateway/*.cpp' 'protocols/*.cpp' 'transports/*.cpp')
  exec packaging/compile_alone.py "$build/lint" ${2:+--latest "$2"} "${sources[@]}"
fi

packaging/prose.py

files '*.h' '*.cpp' | xargs -r clang-format-14 --dry-run -Werror
echo "lint: format is as .clang-format says"

[ "${1:-}" != --quick ] || exit 0
files 'config/*.cpp' 'gateway/*.cpp' 'protocols/*.cpp' 'transports/*.cpp' 'tests/*.cpp' | xargs -r packaging/compile_alone.py "$build/lint"
files 'config/*.cpp' 'gateway/*.cpp' 'protocols/*.cpp' 'transports/*.cpp' | tidy
echo "lint: clang-tidy has no complaint"
