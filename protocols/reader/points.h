// What may stand in `read` of a point: what of a tag is wanted, and which: "tag", "counter",
// "low@3". ValueOf gives what a message says.
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

inline constexpr std::size_t kRing = 16;  ///< tags that are remembered

struct Item {
  enum class Kind : std::uint8_t {
    tag,   ///< its digits or text
    high,  ///< of its 48 bits, 16 each
    middle,
    low,
    counter,  ///< its number
    time,     ///< when it came, s since 1970 UTC
    present,  ///< from here on: of what came last, new or not
    repeats,
    message,
    number,
    identity,  ///< what it says that it is
  } kind = Kind::tag;
  std::size_t back = 0;   ///< so many tags before the last one
  std::size_t first = 0;  ///< of number: the characters that hold it, from 1 on; 0: all
  std::size_t last = 0;

  bool of_tag() const { return kind <= Kind::time; }
  /// Every message renews it, so that reading the tag now does.
  bool of_message() const { return kind >= Kind::present && kind <= Kind::number; }
};

Result<Item> ParseItem(const config::Point& point);
Status CheckPoint(const config::Point& point);
Status CheckDevice(const config::Device& device);
std::span<const DecoderSpec> DecoderTable();

// What a message says, as values of points.
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
