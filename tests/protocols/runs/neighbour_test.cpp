// One device of a line fails, in every way that there is; its neighbour keeps its polls.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

enum class Failure : std::uint8_t { dead, refuses, corrupt, late, slow, misnamed };

std::string NameOf(Failure failure) {
  constexpr const char* kNames[] = {"Dead", "Refuses", "Corrupt", "Late", "Slow", "Misnamed"};
  return kNames[static_cast<std::size_t>(failure)];
}

/// As the device at `address` says no to `request`.
Bytes RefusalOf(const Protocol& protocol, View request, const std::string& address) {
  if (protocol.name == "spabus") {
    const std::string said = "<" + address + "N:6:";
    std::uint8_t sum = 0;
    for (const char c : said) sum ^= static_cast<std::uint8_t>(c);
    return ToBytes(said + HexByte(sum) + "\r\n");
  }
  Bytes reply = {static_cast<std::uint8_t>(std::stoi(address)),
                 static_cast<std::uint8_t>(request[1] | 0x80U), 0x02};
  const std::uint16_t crc = Crc16(reply);
  reply.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  reply.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return reply;
}

class Neighbour : public ::testing::TestWithParam<std::tuple<std::string, Failure>> {};

TEST_P(Neighbour, KeepsItsPolls) {
  const auto& [name, failure] = GetParam();
  const auto& setup = RealLine(name);
  Rig rig(setup, [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1s;
    // What it can do alone in half of the time.
    auto& points = line.devices[1].points;
    points.resize(std::min<std::size_t>(points.size(), 8));
  });
  VirtualLine::WireTwin& bad = rig->twin(0);
  const Duration reply = *setup.protocol->timing(setup.serial).reply;
  const Duration ceiling = *setup.protocol->timing(setup.serial).ceiling;
  switch (failure) {
    case Failure::dead:
      bad.manner.dead = true;
      break;
    case Failure::refuses:
      bad.manner.instead = [&](View request) {
        return RefusalOf(*setup.protocol, request, rig->config().lines[0].devices[0].address);
      };
      break;
    case Failure::misnamed:
      bad.manner.instead = [&](View request) {
        return RefusalOf(*setup.protocol, request, rig->config().lines[0].devices[1].address);
      };
      break;
    case Failure::corrupt:
      bad.manner.distort = [](Bytes bytes) {
        bytes[bytes.size() / 2] ^= 0x01;
        return bytes;
      };
      break;
    case Failure::late:
      bad.manner.think = ceiling + 200ms;
      break;
    case Failure::slow:
      bad.manner.think = reply - 20ms;
      break;
  }
  rig->Open();
  constexpr Duration kTime = 3min;
  std::size_t reads = 0;
  rig->read = [&](std::uint32_t device, Instant) { reads += device == 1 ? 1 : 0; };
  rig->RunFor(kTime);
  const double missed = rig->StatusOf(1).missed;
  const double share = 1 - missed / (kTime / 1s);
  std::printf("%-16s %-8s neighbour has %.3f of its polls, %zu reads\n", name.c_str(),
              NameOf(failure).c_str(), share, reads);
  EXPECT_GE(share, 0.95);
}

INSTANTIATE_TEST_SUITE_P(
    Failures, Neighbour,
    ::testing::Combine(::testing::Values("Spa9600", "ModbusRtu19200"),
                       ::testing::Values(Failure::dead, Failure::refuses, Failure::corrupt,
                                         Failure::late, Failure::slow, Failure::misnamed)),
    [](const auto& info) { return std::get<0>(info.param) + NameOf(std::get<1>(info.param)); });

}  // namespace
}  // namespace baudgate
