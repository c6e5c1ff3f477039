// What only a whole line shows: times that cannot work together, more polls than the bit rate has
// room for. Lines without errors come from config/loader; warnings go to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/catalog/catalog.h"
#include "config/model/line.h"
#include "config/model/problem.h"

namespace baudgate::config {

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
