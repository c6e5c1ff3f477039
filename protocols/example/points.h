// What may stand in `read` of a point: the number of an item, 1 to 999.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "config/model/point.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::example {

Result<unsigned> ParseItem(const config::Point& point);

Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

}  // namespace baudgate::protocols::example
