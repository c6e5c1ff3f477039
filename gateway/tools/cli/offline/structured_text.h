// `baudgate map --format st`: the points as global variables of a PLC program.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>

#include "config/model/config.h"

namespace baudgate {

/// Structured Text of IEC 61131-3. The registers and bits of the units lie one behind the other in
/// the PLC's inputs; what may be written lies in its outputs alike. Comments say which registers
/// the PLC has to copy where.
void PrintStructuredText(const config::Config& config, std::ostream& out);

}  // namespace baudgate
