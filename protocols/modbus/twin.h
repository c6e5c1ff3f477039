// ModbusTwin simulates a Modbus slave for gateway/tools/simulate/simulator.h, from a device's
// points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "protocols/common/twin_points.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/settings.h"
#include "protocols/modbus/values.h"
#include "protocols/twin.h"

namespace baudgate::protocols::modbus {

class ModbusTwin : public Twin {
 public:
  ModbusTwin(Framing framing, const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;

 private:
  /// The present contents of a range of one table: registers, or bits as 0 and 1.
  struct Image {
    Space space;
    std::size_t address = 0;
    Registers words;
    std::vector<bool> there;  ///< true if a point covers the word

    std::size_t end() const { return address + words.size(); }
  };

  Bytes AnswerPdu(View pdu, Instant now);
  Bytes Read(View pdu, Instant now) const;
  Bytes Write(View pdu, Instant now);
  Bytes MaskWrite(View pdu, Instant now);
  Bytes ReadWrite(View pdu, Instant now);
  /// Answers reads without an address range, such as function 17 (server id).
  Bytes ReadOne(View pdu, Instant now) const;
  Bytes Identify(View pdu, Instant now) const;
  std::string SaysOf(Table table, std::size_t object, Instant now) const;

  Image ImageOf(const Space& space, std::size_t address, std::size_t count, Instant now) const;
  void Draw(const TwinPoints<Location>::One& point, Image& image, Instant now) const;
  /// True if a range is allowed to be read or written: all its words exist, or with `missing: zero`
  /// at least one. `there`: for each word of the range, whether it exists.
  bool Allows(const std::vector<bool>& there) const;
  /// Number of words up to the end of the last point.
  std::size_t CountOf(const Space& space) const;
  /// Writes `words` to the points from `address` on. Returns 0, or the exception code.
  std::uint8_t Store(Table table, std::size_t address, const Registers& words, Instant now);

  Framing framing_;
  const config::Device& device_;
  Settings settings_;
  std::uint8_t slave_;
  std::uint8_t reply_as_;
  TwinPoints<Location> points_;
};

}  // namespace baudgate::protocols::modbus
