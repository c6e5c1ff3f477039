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
/// "ST,GS,+  12.35kg" is 12.35. Bad where there is none, or a second one that could be meant; where
/// another unit of what `unit`, that of the point, measures stands behind the number ("12.35 lb",
/// "1.2 psi" for bar); and, if `unit` is one of mass, where words stand beside the number and no
/// unit does ("Err 03"). Words beside chosen characters do not matter.
Decoded NumberIn(const Item& item, std::string_view text, std::string_view unit);
bool IsMass(std::string_view unit);
/// The unit behind the first number, if it measures the same as `unit`; empty: there is none.
std::optional<std::string_view> UnitBehind(std::string_view text, std::string_view unit);
/// "KG" is kg, and "MM" is mm; "MV" is not mV.
bool IsSameUnit(std::string_view said, std::string_view unit);

}  // namespace baudgate::protocols::reader
