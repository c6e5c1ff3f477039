// Simulated devices whose faults are written as for `baudgate simulate --fault`, on a wire with 1
// ms per character.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "gateway/tools/simulate/twin_faults.h"
#include "tests/support/toy_protocol.h"

namespace baudgate::tools {

inline constexpr Instant kStart = Instant() + 1h;
inline const Bytes kRequest = ToBytes("?A1\r");
inline const Bytes kReply = ToBytes("0123456789");

inline TwinWire Wire() {
  TwinWire wire;
  wire.serial.baud = 10'000;
  wire.paced = true;
  return wire;
}

inline Fault Parsed(const std::string& text) {
  auto fault = ParseFault(text);
  EXPECT_TRUE(fault) << (fault ? "" : fault.error());
  return fault ? *fault : Fault{};
}

inline TwinFaults Make(const std::vector<std::string>& texts, const TwinWire& wire = Wire(),
                       TwinFaults::Stranger stranger = {}) {
  std::vector<Fault> faults;
  for (const std::string& text : texts) faults.push_back(Parsed(text));
  return TwinFaults(std::move(faults), wire, kStart, std::move(stranger));
}

inline std::vector<std::string> Shown(const std::vector<TimedPiece>& pieces) {
  std::vector<std::string> shown;
  for (const TimedPiece& piece : pieces)
    shown.push_back(FormatDuration(piece.after) + " " + std::string(AsText(piece.bytes)));
  return shown;
}

inline std::vector<std::string> Said(TwinFaults& faults, Duration since_start = {},
                                     const Bytes& reply = kReply) {
  return Shown(faults.Deliver(kRequest, reply, kStart + since_start));
}

}  // namespace baudgate::tools
