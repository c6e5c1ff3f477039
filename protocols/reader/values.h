// What a message says, as values of points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/time.h"
#include "protocols/common/decoded.h"
#include "protocols/reader/points.h"

namespace baudgate::protocols::reader {

struct Tag {
  std::string text;
  std::uint64_t counter = 0;
  WallTime received{};
};

/// `item` is of_tag.
Decoded ValueOf(const Item& item, const Tag& tag);
/// "ST,GS,+  12.35kg" is 12.35. Bad where there is none, or a second one that could be meant.
Decoded NumberIn(const Item& item, std::string_view text);

}  // namespace baudgate::protocols::reader
