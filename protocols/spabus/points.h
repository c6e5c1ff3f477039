// What may stand in a point's `read` and `write`: items of a slave that a gateway may touch. Text
// comes from the configuration; addresses go to planning, decoding and the twin. DecodeValue and
// EncodeValue convert the text of a value.
// SPDX-License-Identifier: Apache-2.0
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

/// A point that can be read, with its address already parsed.
struct ReadPoint {
  Address address;
  std::size_t index = 0;  ///< into the device's points
  const config::Point* point = nullptr;
  bool offset = false;  ///< how far the relay's clock is off (clock.h); its address is T
};
std::vector<ReadPoint> ReadablePoints(std::span<const config::Point> points);

/// The address by which a point is written: its `write`, or its `read` where that is the same.
Result<Address> WriteAddress(const config::Point& point);

/// Whether `read`, `write`, type and table fit together.
Status CheckPoint(const config::Point& point);

/// Slave numbers that few devices can have, and outputs that may be written.
std::vector<ConfigRemark> DoubtsOf(const config::Device& device);

std::span<const DecoderSpec> DecoderTable();

// The text of one value on the SPA Bus, to and from the value of a point. Text comes from replies
// and goes into write requests; in the twin the other way round.

/// A text that is not of the point's type never becomes a number: empty text is a sensor failure,
/// anything else says that the profile is wrong.
Decoded DecodeValue(std::string_view text, const config::Point& point);

/// As DecodeValue where no point says what is expected: number if it reads as one, else text.
Value GuessValue(std::string_view text);

/// The text to write for a raw value: never an exponent, never a reserved character. Numbers as a
/// device prints them, "30.3": the shortest text of a float32, rounded to the point's decimals. An
/// error when the value does not fit the point's type, or is 0 or out of range once rounded.
Result<std::string> EncodeValue(const Value& value, const config::Point& point);

/// What a slave prints for a value: booleans as 0 and 1, numbers with the point's decimals, else
/// two to four.
std::string PrintValue(const Value& value, const config::Point& point);

}  // namespace baudgate::protocols::spabus
