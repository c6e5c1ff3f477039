// `ParseItem` parses the `read` text of a point, such as "tag", "counter" or "low@3": a property of
// the latest tags or of the latest message. ValueOf and NumberIn return the values.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "protocols/common/decoded.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::reader {

inline constexpr std::size_t kRing = 16;

struct Item {
  enum class Kind : std::uint8_t {
    tag,   ///< the digits or the text of a tag
    high,  ///< the upper 16 of the 48 bits of a tag
    middle,
    low,
    counter,  ///< the number of a tag, counted from 1
    time,     ///< when a tag came, in s since 1970 UTC
    /// The kinds from here to `number` belong to the latest message, whether its tag is new or not.
    present,
    repeats,
    message,
    number,
    identity,  ///< the name that the reader returns for itself
  } kind = Kind::tag;
  std::size_t back = 0;  ///< which tag: 0 for the newest, 1 for the tag before it
  /// For `number`: `first` and `last` are the characters that contain it, counted from 1. `first`
  /// 0: the whole message.
  std::size_t first = 0;
  std::size_t last = 0;

  bool of_tag() const { return kind <= Kind::time; }
  /// True if every message gives the item a new value. The command `r` then reads the item.
  bool of_message() const { return kind >= Kind::present && kind <= Kind::number; }
};

Result<Item> ParseItem(const config::Point& point);
Status CheckPoint(const config::Point& point);
Status CheckDevice(const config::Device& device);
std::span<const DecoderSpec> DecoderTable();

struct Tag {
  std::string text;
  std::uint64_t counter = 0;
  WallTime received{};
};

/// Returns the value of `item` for `tag`. item.of_tag() must be true.
Decoded ValueOf(const Item& item, const Tag& tag);
/// Returns the number in `text`: "ST,GS,+  12.35kg" is 12.35. `unit` is the unit of the point. The
/// quality is bad in these cases:
///  - There is no number, or a second number that could be the right one.
///  - Another unit of the same quantity is behind the number ("12.35 lb" for kg, "1.2 psi" for
///    bar).
///  - `unit` is a unit of mass, and the text has words but no unit ("Err 03"). This does not apply
///    if the item selects characters of the text.
Decoded NumberIn(const Item& item, std::string_view text, std::string_view unit);
bool IsMass(std::string_view unit);
/// Returns the unit behind the first number in `text` if it is a unit of the same quantity as
/// `unit`. Empty: there is no such unit.
std::optional<std::string_view> UnitBehind(std::string_view text, std::string_view unit);
/// True if the received unit `said` is the unit of the point. Examples: "KG" is kg, "MM" is mm, but
/// "MV" is not mV.
bool IsSameUnit(std::string_view said, std::string_view unit);

}  // namespace baudgate::protocols::reader
