// Checks and parses `read` and `write` of points: the items of a slave that a gateway is allowed to
// use. DecodeValue and EncodeValue convert the text of a value.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "protocols/common/decoded.h"
#include "protocols/protocol.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {

struct ReadPoint {
  Address address;
  std::size_t index = 0;
  const config::Point* point = nullptr;
  /// True: the point is the clock offset of the relay (ClockOffset); its address is T.
  bool offset = false;
};
std::vector<ReadPoint> ReadablePoints(std::span<const config::Point> points);

/// Returns the address for writes of a point: its `write`, or its `read` if `write` is empty.
Result<Address> WriteAddress(const config::Point& point);

Status CheckPoint(const config::Point& point);

/// Returns warnings: slave numbers that few devices can have, and outputs that are writable.
std::vector<ConfigRemark> DoubtsOf(const config::Device& device);

std::span<const DecoderSpec> DecoderTable();

/// Decodes a text by the point's type. For a point with a number, an empty text is a sensor
/// failure, and any other text that is no number of this type means that the profile is wrong.
Decoded DecodeValue(std::string_view text, const config::Point& point);

/// Decodes a text that belongs to no point: to a number if it is one, else to a text.
Value GuessValue(std::string_view text);

/// Returns the text that writes a raw value, without an exponent and without reserved characters.
/// Numbers have the form that a device prints, such as "30.3": the shortest text of a float32,
/// rounded to the point's decimals. Fails if the value does not fit the point's type, or becomes 0
/// or out of range by rounding.
Result<std::string> EncodeValue(const Value& value, const config::Point& point);

/// Returns the text that a slave sends for a value. A boolean is 0 or 1; an integer without a scale
/// has no decimals. Any other number is rounded to the point's decimals (4 if none are configured);
/// trailing zeros after the second decimal are dropped. In a text, '-' replaces characters that the
/// bus does not allow. Empty: the number is not finite.
std::string PrintValue(const Value& value, const config::Point& point);

}  // namespace baudgate::protocols::spabus
