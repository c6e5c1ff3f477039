#!/usr/bin/env bash
# Measures the figures of docs/performance.md on this machine, each as a ratio in one run.
# usage: packaging/bench.sh [line] [dead] [modbus] [tls] [routes] [drive] [delay] [scale] [cost] [crowd] [rivals] [history] [tag] [harm] [image] [participants] [events] [reload] [page] [loaded] [port] [outlets]    all but the last seven without arguments; twenty minutes
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

build_product baudgate_bench baudgate_dds_bench baudgate baudgate-dds
say "measuring; keep the machine quiet meanwhile"
apart=()
others=()
for part in "$@"; do
  case $part in
    image | participants | events | reload | page | loaded | port | outlets) apart+=("$part") ;;
    *) others+=("$part") ;;
  esac
done
[ $# != 0 ] || apart=(image)
[ $# != 0 ] && [ ${#others[@]} = 0 ] || build/release/baudgate_bench "${others[@]}"
for part in "${apart[@]}"; do
  case $part in
    image) build/release/baudgate_dds_bench image ;;
    participants) build/release/baudgate_dds_bench participants build/release/baudgate "${SUBSCRIBERS:-20}" ;;
    events) tests/bench/event_to_dds.py build/release ;;
    reload) tests/bench/reload.py build/release ;;
    page) tests/bench/page.py build/release ;;
    loaded) tests/bench/loaded.py build/release ;;
    outlets)
      install_packages mosquitto
      tests/bench/outlets.py build/release
      ;;
    port)
      install_packages socat ser2net
      tests/bench/port_session.py build/release
      ;;
  esac
done
