// What only a whole line shows: times that can not work together, and more polls than the bit rate
// has room for. Fed by config/loader with lines that have no errors; results are warnings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/catalog.h"
#include "config/config.h"
#include "config/problem.h"

namespace baudgate::config {

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
