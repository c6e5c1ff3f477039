// The twins of a whole line of a configuration: devices of several protocols, and settings of their
// own. For `baudgate simulate -c` and the demo.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/catalog/catalog.h"
#include "config/model/line.h"
#include "gateway/tools/simulate/simulator.h"

namespace baudgate {

/// `options` say where, and how they misbehave; the line says at which pace, and which settings a
/// reader has to make.
Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options);

}  // namespace baudgate
