// Many twins of several protocols on one bus, each with settings of its own, and a second master:
// for tests of scans. Knows the bits of a character, so that 7E1 heard as 8N1 is what it is on a
// real wire. Has neither port nor clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/tools/simulate/simulator.h"
#include "protocols/protocol.h"

namespace baudgate {

/// Characters on the wire, the first bit first; silence around them is 1.
using WireBits = std::vector<bool>;
WireBits ToWire(View bytes, const config::SerialSettings& serial);
struct FromWire {
  Bytes bytes;  ///< FF in the place of a damaged one, as ports mark them
  std::uint32_t damaged = 0;
};
FromWire FromWireBits(const WireBits& bits, const config::SerialSettings& serial);

struct TwinWish {
  std::string protocol;
  std::string profile;
  std::string address;
  config::SerialSettings serial;
  std::vector<std::pair<std::string, std::string>> options{};
  bool judges_parity = true;  ///< it does not hear what comes in another format
};

class TwinBus {
 public:
  void Add(const TwinWish& wish);
  /// Its options, as a test wants them.
  config::Device& device(std::size_t index) { return *twins_[index]->device; }

  /// What comes back when `request` is sent with these settings, and how many twins have answered.
  struct Answer {
    FromWire heard;
    int speakers = 0;
  };
  /// Two that speak at once pull the wire down together, or come one after the other.
  enum class Two { together, in_turn };
  Answer Ask(View request, const config::SerialSettings& serial, Instant now,
             Two two = Two::together);

 private:
  struct Inhabitant {
    const protocols::Protocol* protocol;
    config::SerialSettings serial;
    bool judges_parity;
    std::unique_ptr<config::Device> device;
    std::unique_ptr<tools::SimulatedValues> values;
    std::unique_ptr<protocols::Twin> twin;
  };
  std::vector<std::unique_ptr<Inhabitant>> twins_;
  std::size_t asked_ = 0;  // none of two begins at the same moment every time
};

}  // namespace baudgate
