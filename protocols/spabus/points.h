// What may stand in a point's `read` and `write`: items of a slave that a gateway may touch. Text
// comes from the configuration; addresses go to planning, decoding and the twin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "config/model/point.h"
#include "protocols/protocol.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {

/// A point that can be read, with its address already parsed.
struct ReadPoint {
  Address address;
  std::size_t index = 0;  ///< into the device's points
  const config::Point* point = nullptr;
  bool offset = false;  ///< how far the relay's clock is off (clock_offset.h); its address is T
};
std::vector<ReadPoint> ReadablePoints(std::span<const config::Point> points);

/// The address by which a point is written: its `write`, or its `read` where that is the same.
Result<Address> WriteAddress(const config::Point& point);

/// Whether `read`, `write`, type and table fit together.
Status CheckPoint(const config::Point& point);

/// Slave numbers that few devices can have, and outputs that may be written.
std::vector<Doubt> DoubtsOf(const config::Device& device);

std::span<const DecoderSpec> DecoderTable();

}  // namespace baudgate::protocols::spabus
