// One entry of modbus.routes: which unit ids go to which line or server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/lines.h"
#include "config/model/line.h"
#include "config/model/listener.h"
#include "config/model/route.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// `lines`: those that it may lead to. A server that is one of `listeners` would ask itself.
Route ReadRoute(const YamlNode& node, const std::vector<Listener>& listeners,
                const std::vector<Line>& lines, LoadContext& context);

}  // namespace baudgate::config
