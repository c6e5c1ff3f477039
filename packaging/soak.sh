#!/usr/bin/env bash
# Runs that are too long for every change.
# usage: packaging/soak.sh                  all of these, one after the other
#        packaging/soak.sh tests            all tests of packaging/test.sh, with random runs ten times as long
#        packaging/soak.sh virtual [HOURS]  damage, deaths and echo for 24 hours of virtual time
#        packaging/soak.sh lag [MILLIONS]   a lagging server, 1000 million exchanges in virtual time: hours
#        packaging/soak.sh ptys [MINUTES]   10 real minutes each on ptys: all faults; a lagging server. AddressSanitizer
#        packaging/soak.sh datagrams [MINUTES]  what DDS is let read, fuzzed for 10 minutes from its corpus
#        packaging/soak.sh discovery [ROUNDS]  ten DDS gateways found by two discovery servers, then by peers; 50 kills each
#        packaging/soak.sh audit [KILLS]    the gateway killed 200 times while a client writes; every write on the wire has its record
#        packaging/soak.sh events [THOUSANDS] [KILLS]  a million events of relays and meters under virtual time, over kills and power cuts: file, DDS and Modbus
#                                           get each once, in order; then the real gateway killed 200 times in bursts of events of a relay
#        packaging/soak.sh service [MINUTES]  a gateway with 14 devices, without and with DDS: watched for 30 minutes, then killed 50 times
#        packaging/soak.sh everything [MINUTES]  a gateway with AddressSanitizer, TLS, users and DDS: three hours of clients, attacks, reloads and dead devices
#        packaging/soak.sh fuzz [RUNS]      every fuzz target, 10,000,000 executions each: some hours
# An existing build of the targets is taken from $BAUDGATE_FUZZ_BUILD.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

# whole NUMBER: fails unless NUMBER is a whole number from 1 on.
whole() { [[ $1 =~ ^[1-9][0-9]*$ ]] || usage; }

# Prints the result of ctest. tests/support/long_run.h has the runs that read $BAUDGATE_LONG_RUNS.
soak_tests() {
  build_tests release
  say "all tests, with long random runs"
  BAUDGATE_LONG_RUNS=1 ctest --test-dir build/release --output-on-failure -j 2
}

# Prints a line for each kind of line: exchanges, faults, and the results of damage.
soak_virtual() {
  local hours=${1:-24}
  whole "$hours"
  build_tests release runs_test
  say "$hours hours of virtual time"
  BAUDGATE_SOAK_HOURS=$hours build/release/tests/runs_test --gtest_filter='*/Soak.*'
}

# Prints a line for each kind of line: exchanges, checked readings, and the faults with a wrong reading.
soak_lag() {
  local millions=${1:-1000}
  whole "$millions"
  build_tests release runs_test
  say "$millions million exchanges behind a lagging server"
  BAUDGATE_LAG_EXCHANGES=${millions}000000 build/release/tests/runs_test --gtest_filter='*RandomLag*'
}

# Prints a line for each protocol, and one about the heap; then a line for each kind of line behind a
# lagging server.
soak_ptys() {
  local minutes=${1:-10}
  whole "$minutes"
  build_tests asan baudgate_soak
  local suite
  for suite in PtySoak LagSoak; do
    say "$minutes minutes on ptys: $suite"
    BAUDGATE_SOAK_SECONDS=$((minutes * 60)) build/asan/tests/baudgate_soak --gtest_filter="$suite.*"
  done
}

# Prints a line for each target; for a finding the path of its input, and a failure at the end.
soak_fuzz() {
  build_fuzz
  say "fuzzing every target, ${1:-10000000} executions each"
  fuzz -runs="${1:-10000000}"
}

# Prints one line: executions, or the finding.
soak_datagrams() {
  local minutes=${1:-10}
  whole "$minutes"
  build_fuzz
  say "fuzzing the check of datagrams for $minutes minutes"
  tests/fuzz/run.sh "${BAUDGATE_FUZZ_BUILD:-build/fuzz}" datagram_check \
    -max_total_time=$((minutes * 60))
}

# Prints a line for each kill, with the time until the subscriber had all 10,000 points again; a line for each kind.
soak_discovery() {
  local rounds=${1:-50} by
  whole "$rounds"
  build_tests release baudgate_soak
  for by in servers peers; do
    say "ten gateways and a subscriber without multicast, found by $by, $rounds kills"
    BAUDGATE_SOAK_BY=$by BAUDGATE_SOAK_ROUNDS=$rounds BAUDGATE_SOAK_GATEWAYS=10 BAUDGATE_SOAK_POINTS=1000 \
      build/release/tests/baudgate_soak --gtest_filter='DiscoverySoak.*'
  done
}

# Prints one line: kills, writes on the wire, records.
soak_audit() {
  local kills=${1:-200}
  whole "$kills"
  build_tests release baudgate system_routes_test
  say "a gateway that is killed $kills times while a client writes"
  BAUDGATE_AUDIT_KILLS=$kills build/release/tests/system_routes_test --gtest_filter='Audit.*Killed*'
}

# Prints two lines: events, kills, power cuts; kills, events.
soak_events() {
  local thousands=${1:-1000} kills=${2:-200}
  whole "$thousands"
  whole "$kills"
  build_tests release baudgate spabus_module runs_test system_routes_test
  say "$thousands thousand events under virtual time"
  BAUDGATE_SOAK_EVENTS=${thousands}000 build/release/tests/runs_test --gtest_filter='EventSoak.*'
  say "a gateway that is killed $kills times while a relay has bursts of events"
  BAUDGATE_EVENT_KILLS=$kills build/release/tests/system_routes_test --gtest_filter='Events.*Killed*'
}

# Prints four lines each: times, memory, descriptors, shared memory.
soak_service() {
  local minutes=${1:-30} dds
  whole "$minutes"
  build_tests release baudgate baudgate-dds baudgate_soak
  for dds in 0 1; do
    say "a gateway with 14 devices, $minutes minutes and 50 kills, DDS: $dds"
    BAUDGATE_SOAK_DDS=$dds BAUDGATE_SOAK_SECONDS=$((minutes * 60)) BAUDGATE_SOAK_KILLS=50 \
      build/release/tests/baudgate_soak --gtest_filter='ServiceSoak.*'
  done
}

# Prints a line each about memory, descriptors and the uses of the interfaces.
soak_everything() {
  local minutes=${1:-180}
  whole "$minutes"
  build_tests release baudgate
  build_tests asan baudgate baudgate-dds
  say "a gateway with every interface, $minutes minutes"
  tests/soak/everything.py build/asan/baudgate build/release/baudgate "$minutes"
}

usage() {
  sed -n '2,/^set /{/^#/s/^# //p}' "$0" >&2
  exit 2
}

# One function for each part: soak_PART.
if [ $# = 0 ]; then
  soak_tests
  soak_virtual
  soak_lag
  soak_ptys
  soak_datagrams
  soak_discovery
  soak_audit
  soak_events
  soak_service
  soak_everything
  soak_fuzz
  exit
fi
part=$1
[ "$(type -t "soak_$part")" = function ] || usage
shift
"soak_$part" "$@"
