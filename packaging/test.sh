#!/usr/bin/env bash
# Runs all tests on a fresh Debian 12: installs what is missing, builds, runs ctest.
# usage: packaging/test.sh [PRESET] [COMMAND]    PRESET: release (default), asan or tsan, see CMakePresets.json. COMMAND runs beside
#        the tests, when the processors have nothing else to do, and gets SIGTERM behind them; if it fails, this fails.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

preset=${1:-release}
build_tests "$preset"
beside=''
if [ -n "${2:-}" ]; then
  # Programs that tests start are sessions of their own, so a nice value alone would not be heeded beside them.
  setsid sh -c 'echo 19 >/proc/self/autogroup 2>/dev/null; exec nice -n 19 "$@"' sh $2 >"build/$preset/beside.log" 2>&1 &
  beside=$!
fi
say "running the tests ($preset)"
# Most programs wait for lines more than they compute: three at a time, long ones first (COST in tests/).
ctest --test-dir "build/$preset" --output-on-failure -j 3

# A test that this machine does not let run is no test that has passed.
skipped=$(sed -n 's/^\[  SKIPPED \] \(.*\) (.* ms)$/\1/p' "build/$preset/Testing/Temporary/LastTest.log" | sort -u)
if [ -n "$skipped" ]; then
  say "NOT RUN, because this user may not make namespaces (run as root):"
  echo "$skipped"
fi
if [ -n "$beside" ]; then
  say "beside the tests: $2"
  done=0
  kill -TERM "$beside" 2>/dev/null || true
  wait "$beside" || done=$?
  tail -n 50 "build/$preset/beside.log"
  [ $done = 0 ]
fi
