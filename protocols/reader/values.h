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
/// The number in `text`: "ST,GS,+  12.35kg" is 12.35. `unit`: the unit of the point. Bad if
///  - there is no number, or a second number that could be meant;
///  - another unit of the same quantity stands behind the number ("12.35 lb" for kg, "1.2 psi" for
///    bar);
///  - `unit` is a unit of mass, and words but no unit stand beside the number ("Err 03"). If the
///    item chooses characters of the text, words do not matter.
Decoded NumberIn(const Item& item, std::string_view text, std::string_view unit);
bool IsMass(std::string_view unit);
/// The unit behind the first number, if it measures the same as `unit`; empty: there is none.
std::optional<std::string_view> UnitBehind(std::string_view text, std::string_view unit);
/// "KG" is kg, and "MM" is mm; "MV" is not mV.
bool IsSameUnit(std::string_view said, std::string_view unit);

}  // namespace baudgate::protocols::reader
