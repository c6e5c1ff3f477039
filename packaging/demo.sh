#!/usr/bin/env bash
# Shows baudgate at work on a fresh Debian 12 without any hardware: installs what the build needs, builds,
# and runs twins of all shipped devices, the gateway that polls them and a live table.
# usage: packaging/demo.sh [--seconds N]    (all arguments go to `baudgate demo`)
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

build_product baudgate
say "running the demo; Ctrl-C ends it"
exec build/release/baudgate demo "$@"
