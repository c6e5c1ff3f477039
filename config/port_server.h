// The port of a line over the network, in one of two keys of the line:
//
//   serial_server: { at: "127.0.0.1:4001", mode: rfc2217, busy: wait, idle: 10min }   without
//   devices lend: { at: "0.0.0.0:4001", mode: raw, for: 30min, allow: [10.0.0.7] }            with
//   devices
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/lines.h"
#include "config/model/line.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Reads both keys into `line`.
void ReadPortServers(MapReader& map, Line& line, LoadContext& context);

}  // namespace baudgate::config
