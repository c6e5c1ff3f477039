#!/usr/bin/env bash
# Runs one fuzz target on its corpus and prints one line about it. New inputs, the log and whatever
# breaks a promise are kept in BUILD/found.
# usage: tests/fuzz/run.sh BUILD TARGET [OPTION OF LIBFUZZER]…
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
target=$2
shift 2

read -r longest dictionary < <(awk -v t="$target" '$1 == t { print $2, $3 }' "$here/targets.txt")
found=$build/found/$target
mkdir -p "$found"
log=$found.log
corpus=$here/corpus/$target
if [ -z "$(ls -A "$corpus" 2>/dev/null)" ]; then
  printf 'FAILED %-20s has no corpus: put at least one input into %s\n' "$target" "$corpus"
  exit 1
fi
export UBSAN_OPTIONS=print_stacktrace=1
status=0
"$build/fuzz/$target" -max_len="$longest" -dict="$here/dictionaries/$dictionary.dict" -timeout=20 \
  -print_final_stats=1 -artifact_prefix="$found-" "$@" "$found" "$corpus" \
  >"$log" 2>&1 || status=$?

stat() { sed -n "s/^stat::$1: *//p" "$log" | tail -n 1; }
if [ $status = 0 ]; then
  printf 'ok     %-20s %9s executions, %6s/s, %4s MiB\n' "$target" \
    "$(stat number_of_executed_units)" "$(stat average_exec_per_sec)" "$(stat peak_rss_mb)"
  exit 0
fi
printf 'FAILED %-20s %s\n' "$target" \
  "$(grep -m 1 -E 'not kept:|runtime error:|^SUMMARY:|ERROR:' "$log" || echo "exit status $status")"
printf '       reproducer: %s\n       log: %s\n' \
  "$(sed -n 's/.*Test unit written to //p' "$log" | tail -n 1)" "$log"
exit 1
