// `TwinBus` simulates devices of several protocols with separate serial settings on one bus, for
// tests of scans. It works on the bits of characters: 7E1 received as 8N1 looks as on a real wire.
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

using WireBits = std::vector<bool>;
WireBits ToWire(View bytes, const config::SerialSettings& serial);
struct FromWire {
  Bytes bytes;  ///< a damaged byte is replaced by FF, as in serial ports
  std::uint32_t damaged = 0;
};
FromWire FromWireBits(const WireBits& bits, const config::SerialSettings& serial);

struct TwinWish {
  std::string protocol;
  std::string profile;
  std::string address;
  config::SerialSettings serial;
  std::vector<std::pair<std::string, std::string>> options{};
  bool judges_parity =
      true;  ///< true: the simulated device ignores characters with another parity or length
};

class TwinBus {
 public:
  void Add(const TwinWish& wish);
  config::Device& device(std::size_t index) { return *twins_[index]->device; }

  /// The bytes that are received after a request, and the number of simulated devices that
  /// answered.
  struct Answer {
    FromWire heard;
    int speakers = 0;
  };
  /// How two replies to one request meet: they overlap, or the second follows the first.
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
  std::size_t asked_ = 0;
};

}  // namespace baudgate
