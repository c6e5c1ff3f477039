// `ParseItem` reads `read` of a point: what to report of which tag, such as "tag", "counter",
// "low@3". ValueOf and NumberIn return the values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "protocols/common/decoded.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::reader {

inline constexpr std::size_t kRing = 16;  ///< the number of tags that are stored

struct Item {
  enum class Kind : std::uint8_t {
    tag,   ///< the tag's digits or text
    high,  ///< the upper 16 of the tag's 48 bits
    middle,
    low,
    counter,  ///< the tag's number
    time,     ///< when the tag came, in s since 1970 UTC
    present,  ///< this kind and those below are about the latest message, new or not
    repeats,
    message,
    number,
    identity,  ///< the reader's name for itself
  } kind = Kind::tag;
  std::size_t back = 0;  ///< how many tags before the newest
  /// The first character of the field of `number`, counted from 1; 0: the whole message.
  std::size_t first = 0;
  std::size_t last = 0;

  bool of_tag() const { return kind <= Kind::time; }
  /// True if every message renews the item, so a read of the present tag does as well.
  bool of_message() const { return kind >= Kind::present && kind <= Kind::number; }
};

Result<Item> ParseItem(const config::Point& point);
Status CheckPoint(const config::Point& point);
Status CheckDevice(const config::Device& device);
std::span<const DecoderSpec> DecoderTable();

// A tag or text that a reader has sent.
struct Tag {
  std::string text;
  std::uint64_t counter = 0;
  WallTime received{};
};

/// Returns the value of `item` for `tag`. `item` must be of_tag.
Decoded ValueOf(const Item& item, const Tag& tag);
/// Returns the number in `text`: "ST,GS,+  12.35kg" is 12.35. `unit` is the unit of the point. The
/// quality is bad if
///  - there is no number, or a second number that could be the right one;
///  - another unit of the same quantity is behind the number ("12.35 lb" for kg, "1.2 psi" for
///    bar);
///  - `unit` is a unit of mass, and the text has words but no unit ("Err 03"). If the item selects
///    characters of the text, words do not matter.
Decoded NumberIn(const Item& item, std::string_view text, std::string_view unit);
bool IsMass(std::string_view unit);
/// Returns the unit behind the first number if it is of the same quantity as `unit`; else empty.
std::optional<std::string_view> UnitBehind(std::string_view text, std::string_view unit);
/// True if a received unit equals the point's: "KG" is kg, "MM" is mm, but "MV" is not mV.
bool IsSameUnit(std::string_view said, std::string_view unit);

}  // namespace baudgate::protocols::reader
