#!/usr/bin/env bash
# Runs all tests on a fresh Debian 12: installs what is missing, builds, runs ctest.
# usage: packaging/test.sh [PRESET]    release (default), asan or tsan: see CMakePresets.json
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

preset=${1:-release}
build_tests "$preset"
say "running the tests ($preset)"
# Most programs wait for lines more than they compute: three at a time, long ones first (COST in tests/).
ctest --test-dir "build/$preset" --output-on-failure -j 3
