#!/usr/bin/env bash
# Runs every fuzz target for ten seconds: shows that they build with clang, that their corpora pass and that
# nothing is found quickly. For the night and before a release; what ctest does for each change is to replay the
# corpora. Always with the same seed, so that it judges the change and not the day; the long run with seeds of
# its own is packaging/soak.sh fuzz.
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
