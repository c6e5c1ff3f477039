// Who is asked beside the multicast group, or in its place: `dds: { peers, discovery_servers,
// multicast }`. YAML nodes come from config/outputs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/outputs.h"
#include "config/model/problem.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// After `interfaces`, which must reach what stands here.
void ReadDdsPeers(MapReader& map, Dds& dds, Problems& problems);

}  // namespace baudgate::config
