// What may stand in `read` of a point: what of a tag is wanted, and which: "tag", "counter",
// "low@3".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "config/model/device.h"
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

}  // namespace baudgate::protocols::reader
