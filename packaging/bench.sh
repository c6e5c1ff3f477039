#!/usr/bin/env bash
# Measures the figures of docs/performance.md on this machine, each as a ratio in one run.
# usage: packaging/bench.sh [line] [dead] [modbus] [routes] [drive] [delay] [scale] [cost] [crowd] [harm] [image]    all without arguments; a quarter of an hour
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

install_packages
build bench baudgate_bench baudgate_dds_bench
say "measuring; keep the machine quiet meanwhile"
for part in "$@"; do
  [ "$part" != image ] || build/release/baudgate_dds_bench image
done
[ "$*" = image ] || build/release/baudgate_bench "$@"
[ $# != 0 ] || build/release/baudgate_dds_bench image
