// A Modbus slave that is not there: answers requests from the points of its device. Requests come
// from gateway/tools/simulate/simulator.h, replies go back to it.
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
  /// Both outlive the twin.
  ModbusTwin(Framing framing, const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;

 private:
  /// Registers or bits (0 and 1) of one table, as they stand now.
  struct Image {
    Space space;
    std::size_t address = 0;
    Registers words;
    std::vector<bool> there;  ///< some point has it

    std::size_t end() const { return address + words.size(); }
  };

  Bytes AnswerPdu(View pdu, Instant now);
  Bytes Read(View pdu, Instant now) const;
  Bytes Write(View pdu, Instant now);
  Bytes MaskWrite(View pdu, Instant now);
  Bytes ReadWrite(View pdu, Instant now);
  Bytes ReadOne(View pdu, Instant now) const;  ///< functions that one request reads all of
  Bytes Identify(View pdu, Instant now) const;
  std::string SaysOf(Table table, std::size_t object, Instant now) const;

  Image ImageOf(const Space& space, std::size_t address, std::size_t count, Instant now) const;
  void Draw(const TwinPoints<Location>::One& point, Image& image, Instant now) const;
  /// Whether the range may be read, or written.
  bool Allows(const std::vector<bool>& there) const;
  std::size_t CountOf(const Space& space) const;  ///< up to the last place that a point has
  /// 0, or the exception.
  std::uint8_t Store(Table table, std::size_t address, const Registers& words, Instant now);

  Framing framing_;
  const config::Device& device_;
  Settings settings_;
  std::uint8_t slave_;
  std::uint8_t reply_as_;
  TwinPoints<Location> points_;
};

}  // namespace baudgate::protocols::modbus
