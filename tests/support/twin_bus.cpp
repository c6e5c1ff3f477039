// SPDX-License-Identifier: Apache-2.0
#include "tests/support/twin_bus.h"

#include <gtest/gtest.h>

#include <bit>

#include "config/catalog/option_values.h"
#include "config/loader.h"
#include "protocols/all_protocols.h"
#include "protocols/assembler.h"

namespace baudgate {
namespace {

config::Catalog ShippedCatalog() {
  config::Catalog catalog;
  for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
    catalog.protocols[std::string(protocol->name)] = protocol;
  }
  catalog.profile_dirs = {"config/profiles"};
  return catalog;
}

bool ParityBit(std::uint8_t character, config::Parity parity) {
  const bool odd = std::popcount(character) % 2 == 1;
  return parity == config::Parity::even ? odd : !odd;
}

}  // namespace

WireBits ToWire(View bytes, const config::SerialSettings& serial) {
  WireBits bits;
  for (std::uint8_t byte : bytes) {
    if (serial.data_bits == 7) byte &= 0x7F;
    bits.push_back(false);
    for (int i = 0; i < serial.data_bits; ++i) bits.push_back((byte >> i & 1) != 0);
    if (serial.parity != config::Parity::none) bits.push_back(ParityBit(byte, serial.parity));
    bits.insert(bits.end(), static_cast<std::size_t>(serial.stop_bits), true);
  }
  return bits;
}

FromWire FromWireBits(const WireBits& bits, const config::SerialSettings& serial) {
  FromWire result;
  const auto at = [&bits](std::size_t place) { return place >= bits.size() || bits[place]; };
  for (std::size_t place = 0; place < bits.size();) {
    if (at(place)) {
      ++place;
      continue;
    }
    ++place;
    std::uint8_t byte = 0;
    for (int i = 0; i < serial.data_bits; ++i) {
      byte = static_cast<std::uint8_t>(byte | (at(place++) ? 1 : 0) << i);
    }
    bool good = true;
    if (serial.parity != config::Parity::none) {
      good = at(place++) == ParityBit(byte, serial.parity);
    }
    good = at(place) && good;
    if (at(place)) ++place;
    if (!good) ++result.damaged;
    result.bytes.push_back(good ? byte : 0xFF);
  }
  return result;
}

void TwinBus::Add(const TwinWish& wish) {
  static const config::Catalog kCatalog = ShippedCatalog();
  const protocols::Protocol* protocol = protocols::FindProtocol(wish.protocol);
  ASSERT_NE(protocol, nullptr) << wish.protocol;
  const config::LoadedProfile loaded = config::LoadProfile(wish.profile, *protocol, kCatalog);
  ASSERT_TRUE(loaded.ok()) << wish.profile;
  auto one = std::make_unique<Inhabitant>();
  one->protocol = protocol;
  one->serial = wish.serial;
  one->judges_parity = wish.judges_parity;
  one->device = std::make_unique<config::Device>(
      config::DeviceFromProfile(loaded.profile, *protocol, "twin", wish.address));
  for (const auto& [key, text] : wish.options) {
    for (const protocols::OptionSpec& spec : protocol->options) {
      if (spec.name != key) continue;
      auto value = config::ParseOption(spec, text);
      ASSERT_TRUE(value) << key;
      one->device->options.Set(key, std::move(*value));
    }
  }
  one->values = std::make_unique<tools::SimulatedValues>(one->device->points,
                                                         static_cast<std::uint32_t>(twins_.size()));
  one->twin = protocol->make_twin(*one->device, *one->values);
  twins_.push_back(std::move(one));
}

TwinBus::Answer TwinBus::Ask(View request, const config::SerialSettings& serial, Instant now,
                             Two two) {
  Answer answer;
  WireBits wire;
  const WireBits sent = ToWire(request, serial);
  ++asked_;
  for (const auto& one : twins_) {
    if (one->serial.baud != serial.baud) continue;
    const FromWire heard = FromWireBits(sent, one->serial);
    if (heard.damaged > 0 && one->judges_parity) continue;
    protocols::Assembler assembler;
    assembler.Begin(one->protocol->request_rule,
                    one->protocol->expect({}, ParseOptions(*one->protocol, one->device->options)));
    // A simulated device that does not check parity receives the bytes of the request unchanged.
    assembler.Feed(one->judges_parity ? View(heard.bytes) : request);
    auto frame = assembler.Next(false);
    if (!frame) frame = assembler.Next(true);
    if (!frame) continue;
    const Bytes reply = one->twin->Answer(*frame, now);
    if (reply.empty()) continue;
    const WireBits bits = ToWire(reply, one->serial);
    if (answer.speakers++ > 0 && two == Two::in_turn) {
      wire.insert(wire.end(), bits.begin(), bits.end());
      continue;
    }
    const std::size_t from = answer.speakers > 1 ? asked_ * 7 % 23 : 0;
    if (wire.size() < from + bits.size()) wire.resize(from + bits.size(), true);
    for (std::size_t i = 0; i < bits.size(); ++i) wire[from + i] = wire[from + i] && bits[i];
  }
  answer.heard = FromWireBits(wire, serial);
  return answer;
}

}  // namespace baudgate
