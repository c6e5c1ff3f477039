#!/usr/bin/env bash
# Runs every fuzz target for ten seconds. The targets must build with clang, their corpora must pass, and there
# must be no quick finding. For the night and before a release; ctest replays the corpora for each change. The
# seed is always the same, so that the result depends only on the change. packaging/soak.sh fuzz is the long run
# with other seeds.
# usage: packaging/fuzz_smoke.sh [SECONDS]
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

build_fuzz
say "fuzzing every target for ${1:-10} seconds"
report=$(mktemp)
trap 'rm -f "$report"' EXIT
fuzz -seed=1 -max_total_time="${1:-10}" | tee "$report" || true
all=$(fuzz_targets | wc -l)
passed=$(grep -c '^ok ' "$report" || true)
echo "$passed passed, $((all - passed)) failed"
[ "$passed" = "$all" ]
