#!/usr/bin/env bash
# Checks how the sources are written: clang-format over all of them, clang-tidy (.clang-tidy) over those of the product, and
# with it the thread-safety marks of gateway/base/guarded.h, DDS included.
#   packaging/lint.sh [BUILD_FOLDER]            all; another BUILD_FOLDER than build/release was configured by cmake
#   packaging/lint.sh [BUILD_FOLDER] --changed [COMMIT]   only what differs from COMMIT (main)
#   packaging/lint.sh [BUILD_FOLDER] --quick    format of all, and the marks where members are marked: half a minute
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh
install_packages "${lint_packages[@]}"
build=build/release
case "${1:-}" in
  '' | --*) ;;
  *) build=$1; shift ;;
esac
[ "$build" != build/release ] || configure_product
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
# The sources of the headers that mark members; of a header without a source of its own those beside which it is included.
marked() {
  git grep -l 'include "gateway/base/guarded.h"' -- gateway transports | while read -r file; do
    if [ -f "${file%.*}.cpp" ]; then
      echo "${file%.*}.cpp"
    else
      git grep -l "include \"$file\"" -- gateway transports | sed 's/\.h$/.cpp/'
    fi
  done | sort -u
}

# Slips of English, in documents and in the sentences that the program prints.
slips='can not|be had|lest|a SPA|informations'
if git grep -nwE "$slips" -- '*.md' || git grep -nE "^[^/]*\"[^\"]*\b($slips)\b" -- '*.cpp' '*.h' '*.js'; then
  echo "lint: write these in plain English: cannot, be found, so that not, an SPA, information" >&2
  exit 1
fi
echo "lint: no slip of English that is known here"

files '*.h' '*.cpp' | xargs -r clang-format-14 --dry-run -Werror
echo "lint: format is as .clang-format says"

if [ "${1:-}" = --quick ]; then
  # Marked members are private: nobody else touches them. (clang-tidy wants a check besides warnings.)
  marked | tidy --checks='-*,clang-diagnostic-thread-safety*,bugprone-use-after-move'
  echo "lint: what a mutex guards is touched under it"
  exit
fi
files 'config/*.cpp' 'gateway/*.cpp' 'protocols/*.cpp' 'transports/*.cpp' | tidy
echo "lint: clang-tidy has no complaint"
