// Tests of the simulated devices of a line with devices of different options.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <asio/io_context.hpp>
#include <span>
#include <string>
#include <vector>

#include "config/catalog/option_values.h"
#include "gateway/tools/simulate/simulator.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/protocol.h"
#include "tests/support/toy_protocol.h"

namespace baudgate::tools {
namespace {

config::Device Module(const std::string& address, bool checksum) {
  config::Device device;
  device.name = "module-" + address;
  device.address = address;
  device.protocol = "dcon";
  device.options = config::DefaultOptions(protocols::DconProtocol());
  device.options.Set("checksum", checksum);
  config::Point& input = device.points.emplace_back();
  input.name = "input";
  input.read = "#[0]";
  input.type = config::Type::float32;
  return device;
}

std::vector<std::string> Replies(const config::Line& line, const std::vector<Bytes>& requests) {
  config::Catalog catalog;
  catalog.protocols["dcon"] = &protocols::DconProtocol();
  asio::io_context io{1};
  const auto twins = SimulateLine(io, line, catalog, {});
  if (!twins) return {twins.error()};
  const int port = open((*twins)->path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  EXPECT_GE(port, 0);
  std::vector<std::string> replies;
  for (const Bytes& request : requests) {
    EXPECT_EQ(write(port, request.data(), request.size()), std::ssize(request));
    std::string& reply = replies.emplace_back();
    const Instant limit = std::chrono::steady_clock::now() + 10s;
    while (!reply.ends_with('\r') && std::chrono::steady_clock::now() < limit) {
      io.run_for(1ms);
      char bytes[64];
      const ssize_t count = read(port, bytes, sizeof bytes);
      if (count > 0) reply.append(bytes, static_cast<std::size_t>(count));
    }
  }
  close(port);
  return replies;
}

TEST(LineTwins, EachAnswersInItsOwnChecksumModeInAnyOrder) {
  using protocols::dcon::BuildRequest;
  for (const bool first : {true, false}) {
    config::Line line;
    line.devices = {Module("1", first), Module("2", !first)};
    const auto replies = Replies(line, {BuildRequest("#", 1, first), BuildRequest("#", 2, !first)});
    ASSERT_EQ(replies.size(), 2U);
    const std::size_t bare = sizeof ">+12.345\r" - 1;
    EXPECT_EQ(replies[0].size(), bare + (first ? 2 : 0)) << replies[0];
    EXPECT_EQ(replies[1].size(), bare + (first ? 0 : 2)) << replies[1];
  }
}

/// "0x1" is another spelling of 1.
TEST(FreeAddress, IsTheLowestUnusedAddress) {
  protocols::Protocol numbers = ToyProtocol();
  numbers.canonical_address = [](std::string_view address) -> Result<std::string> {
    if (address == "0x1") return std::string("1");
    return std::string(address);
  };
  const auto free = [&](const std::vector<std::string>& addresses) {
    std::vector<config::Device> devices(addresses.size());
    for (std::size_t i = 0; i < devices.size(); ++i) devices[i].address = addresses[i];
    return FreeAddress(numbers, devices).value_or("none");
  };
  EXPECT_EQ(free({"7"}), "1");
  EXPECT_EQ(free({"0x1", "3"}), "2");
  EXPECT_EQ(free({"2", "1", "3"}), "4");
}

TEST(FreeAddress, IsNoneIfNoOtherAddressIsValid) {
  protocols::Protocol lonely = ToyProtocol();
  lonely.canonical_address = [](std::string_view address) {
    return address == "1" ? Result<std::string>("1") : Error{"there is only one"};
  };
  config::Device device;
  device.address = "1";
  EXPECT_FALSE(FreeAddress(lonely, std::span(&device, 1)));
}

}  // namespace
}  // namespace baudgate::tools
