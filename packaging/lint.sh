#!/usr/bin/env bash
# Checks how the sources are written: clang-format over all of them, clang-tidy (.clang-tidy) over those of the product, and
# with it the thread-safety marks of gateway/base/guarded.h, DDS included.
#   packaging/lint.sh [BUILD_FOLDER]            all; BUILD_FOLDER (build/release) was configured by cmake
#   packaging/lint.sh [BUILD_FOLDER] --changed [COMMIT]   only what differs from COMMIT (main)
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh
install_packages "${lint_packages[@]}"
build=build/release
if [ $# -gt 0 ] && [ "$1" != --changed ]; then build=$1; shift; fi
if [ ! -f "$build/compile_commands.json" ]; then
  echo "lint: $build/compile_commands.json is missing: cmake --preset ${build##*/}" >&2
  exit 2
fi

files() { git ls-files "$@"; }
if [ "${1:-}" = --changed ]; then
  base=${2:-main}
  files() { git diff --name-only --diff-filter=d "$base" -- "$@"; }
fi

files '*.h' '*.cpp' | xargs -r clang-format-14 --dry-run -Werror
echo "lint: format is as .clang-format says"

# A header is looked at with the sources that include it.
files 'config/*.cpp' 'gateway/*.cpp' 'protocols/*.cpp' 'transports/*.cpp' |
  xargs -r -n 4 -P "$(nproc)" clang-tidy-14 -p "$build" --quiet
echo "lint: clang-tidy has no complaint"
