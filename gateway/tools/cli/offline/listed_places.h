// Points of a register list that take each other's registers: a type or a number in it is wrong.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/tools/cli/offline/register_list.h"

namespace baudgate {

/// Adds to its errors where registers are shared in part, and to its warnings where two points read
/// the same. `file`: its name in messages.
void CheckPlaces(const std::string& file, RegisterList& list);

}  // namespace baudgate
