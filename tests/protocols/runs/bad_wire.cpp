// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/bad_wire.h"

#include <algorithm>
#include <bit>
#include <optional>

namespace baudgate::protocols {

BadWire::BadWire(Rig& rig, unsigned seed, WireFaults faults)
    : rig_(rig), faults_(faults), random_(seed), latest_(rig.devices(), std::deque<Latest>(1)) {
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    Manner& manner = rig->twin(device).manner;
    manner.instead = [this, device](View request) -> std::optional<Bytes> {
      latest_[device].push_back({Bytes(request.begin(), request.end()), {}, false});
      if (latest_[device].size() > kRemembered) latest_[device].pop_front();
      return std::nullopt;
    };
    manner.distort = [this, device](Bytes reply) { return Carry(device, std::move(reply)); };
  }
}

void BadWire::End() {
  for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
    rig_->twin(device).manner.instead = {};
    rig_->twin(device).manner.distort = {};
  }
}

bool BadWire::IsBeyondDetection(std::uint32_t device) {
  const auto beyond = [&](const Latest& latest) { return IsBeyondDetection(device, latest); };
  if (std::ranges::none_of(latest_[device], beyond)) return false;
  ++undetected_;
  return true;
}

bool BadWire::IsBeyondDetection(std::uint32_t device, const Latest& latest) const {
  if (!latest.damaged) return false;
  const auto frame =
      Hear(*rig_.setup().protocol, rig_.device(device).options, latest.request, latest.arrived)
          .frame;
  return frame && rig_.setup().good_checksum(*frame);
}

Bytes BadWire::Carry(std::uint32_t device, Bytes reply) {
  ++replies_;
  Latest& latest = Newest(device);
  const bool lost = OneIn(faults_.lost_one_in);
  if (lost) ++lost_;
  latest.arrived = reply;
  if (lost) {
    latest.arrived.clear();
  } else if (!reply.empty() && OneIn(faults_.damaged_one_in)) {
    latest.arrived = Damage(reply);
  }
  latest.damaged = !lost && latest.arrived != reply;
  if (latest.damaged) ++damaged_;
  return latest.arrived;
}

Bytes BadWire::Damage(Bytes reply) {
  const std::size_t at = random_() % reply.size();
  switch (random_() % 8) {
    case 0:
      reply.erase(reply.begin() + static_cast<std::ptrdiff_t>(at));
      return reply;
    case 1:
      reply.insert(reply.begin() + static_cast<std::ptrdiff_t>(at), Noise());
      return reply;
    case 2:
      reply.resize(at);
      return reply;
    case 3:
      return Flip(std::move(reply), at, 4, 12);
    default:
      return Flip(std::move(reply), 0, reply.size(), 1 + random_() % 6);
  }
}

std::uint8_t BadWire::Noise() {
  const unsigned mask = rig_.setup().serial.data_bits == 7 ? 0x7FU : 0xFFU;
  return static_cast<std::uint8_t>(random_() & mask);
}

/// Flips bits on the wire, including parity bits. A byte with wrong parity becomes 0xFF, as in
/// transports/serial_port.h.
Bytes BadWire::Flip(Bytes reply, std::size_t from, std::size_t length, std::size_t count) {
  const config::SerialSettings& serial = rig_.setup().serial;
  const bool parity = serial.parity != config::Parity::none;
  const auto bits = static_cast<std::size_t>(serial.data_bits) + (parity ? 1 : 0);
  std::vector<unsigned> flips(reply.size());
  for (; count > 0; --count) {
    const std::size_t at = from + random_() % length;
    if (at < reply.size()) flips[at] ^= 1U << (random_() % bits);
  }
  for (std::size_t i = 0; i < reply.size(); ++i) {
    const unsigned data = flips[i] & ((1U << static_cast<unsigned>(serial.data_bits)) - 1);
    const bool odd = std::popcount(flips[i]) % 2 != 0;
    reply[i] = parity && odd ? 0xFF : static_cast<std::uint8_t>(reply[i] ^ data);
  }
  return reply;
}

Bytes Spoiled(Bytes reply, std::mt19937& random) {
  if (reply.empty()) return reply;
  const std::size_t at = random() % reply.size();
  switch (random() % 3) {
    case 0:
      return {};
    case 1:
      reply.resize(at);
      return reply;
    default:
      reply[at] ^= static_cast<std::uint8_t>(1U << random() % 7);
      return reply;
  }
}

std::vector<Setup> DamagedLines() {
  std::vector<Setup> lines = RealLines();
  lines.push_back(RealLine("Spa9600"));
  lines.back().name = "SpaWithoutParity";
  lines.back().serial.parity = config::Parity::none;
  return lines;
}

}  // namespace baudgate::protocols
