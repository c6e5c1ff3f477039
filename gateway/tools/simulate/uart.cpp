// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/uart.h"

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace baudgate {
namespace {

using config::Parity;
using config::SerialSettings;

/// A receiver that is off by less than this still samples every bit of a character.
constexpr long kTolerancePerMille = 30;

bool ParityBit(unsigned data, Parity parity) {
  if (parity == Parity::mark || parity == Parity::space) return parity == Parity::mark;
  const bool odd = std::popcount(data) % 2 != 0;
  return parity == Parity::even ? odd : !odd;
}

unsigned DataOf(std::uint8_t byte, const SerialSettings& serial) {
  return serial.data_bits == 7 ? byte & 0x7FU : byte;
}

/// One entry a bit; the wire is idle (1) around it.
std::vector<bool> BitsOf(View sent, const SerialSettings& serial) {
  std::vector<bool> bits = {true};
  for (const std::uint8_t byte : sent) {
    const unsigned data = DataOf(byte, serial);
    bits.push_back(false);
    for (int bit = 0; bit < serial.data_bits; ++bit) bits.push_back(((data >> bit) & 1U) != 0);
    if (serial.parity != Parity::none) bits.push_back(ParityBit(data, serial.parity));
    for (int stop = 0; stop < serial.stop_bits; ++stop) bits.push_back(true);
  }
  return bits;
}

/// The wire against time. A bit of the sender lasts as many units as the receiver's bit rate has
/// bits a second, and the other way round: both are whole numbers.
class Wire {
 public:
  Wire(std::vector<bool> bits, std::int64_t bit) : bits_(std::move(bits)), bit_(bit) {}

  bool At(std::int64_t time) const {
    const auto index = static_cast<std::size_t>(time / bit_);
    return index >= bits_.size() || bits_[index];
  }
  /// When it first shows `level` from `time` on; negative: never again.
  std::int64_t Next(bool level, std::int64_t time) const {
    if (At(time) == level) return time;
    for (std::int64_t index = time / bit_ + 1; index <= Size(); ++index) {
      if (At(index * bit_) == level) return index * bit_;
    }
    return -1;
  }

 private:
  std::int64_t Size() const { return static_cast<std::int64_t>(bits_.size()); }

  const std::vector<bool> bits_;
  const std::int64_t bit_;
};

}  // namespace

Received ReceiveAs(const SerialSettings& receiver, View sent, const SerialSettings& sender) {
  const Wire wire(BitsOf(sent, sender), receiver.baud);
  const std::int64_t bit = sender.baud;
  Received received;
  for (std::int64_t start = wire.Next(false, 0); start >= 0;) {
    std::int64_t at = start + bit / 2;
    if (wire.At(at)) {  // too short for a start bit
      start = wire.Next(false, at);
      continue;
    }
    unsigned data = 0;
    for (int i = 0; i < receiver.data_bits; ++i) {
      at += bit;
      if (wire.At(at)) data |= 1U << i;
    }
    bool whole = true;
    if (receiver.parity != Parity::none) {
      at += bit;
      whole = wire.At(at) == ParityBit(data, receiver.parity);
    }
    at += bit;
    whole = wire.At(at) && whole;
    received.bytes.push_back(whole ? static_cast<std::uint8_t>(data) : std::uint8_t{0});
    if (!whole) ++received.damaged;
    const std::int64_t idle = wire.Next(true, at);
    start = idle < 0 ? -1 : wire.Next(false, idle);
  }
  return received;
}

bool Understand(const SerialSettings& a, const SerialSettings& b) {
  const long difference = std::labs(static_cast<long>(a.baud) - b.baud);
  return difference * 1000 <= kTolerancePerMille * a.baud && a.data_bits == b.data_bits &&
         a.parity == b.parity;
}

}  // namespace baudgate
