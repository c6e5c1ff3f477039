#!/usr/bin/env bash
# Runs all tests on a fresh Debian 12: installs what is missing, builds, runs ctest.
# usage: packaging/test.sh [PRESET]    release (default), asan or tsan: see CMakePresets.json
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

preset=${1:-release}
build_tests "$preset"
say "running the tests ($preset)"
# Most test programs wait for lines more than they compute, so five run at a time, long ones first (COST in tests/). runs_test only
# computes: it counts as two (PROCESSORS).
ctest --test-dir "build/$preset" --output-on-failure -j 5

# A test that cannot run on this machine counts as not passed.
skipped=$(sed -n 's/^\[  SKIPPED \] \(.*\) (.* ms)$/\1/p' "build/$preset/Testing/Temporary/LastTest.log" | sort -u)
if [ -n "$skipped" ]; then
  say "NOT RUN, because this user may not make namespaces (run as root):"
  echo "$skipped"
fi
