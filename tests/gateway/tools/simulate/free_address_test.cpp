// The address that a stranger on the line gets.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

#include "gateway/tools/simulate/simulator.h"
#include "tests/support/toy_protocol.h"

namespace baudgate {
namespace {

/// "0x1" is 1 in another spelling.
TEST(FreeAddress, IsTheLowestThatNobodyHas) {
  Protocol numbers = ToyProtocol();
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

TEST(FreeAddress, IsNoneWhereNoOtherIsValid) {
  Protocol lonely = ToyProtocol();
  lonely.canonical_address = [](std::string_view address) {
    return address == "1" ? Result<std::string>("1") : Error{"there is only one"};
  };
  config::Device device;
  device.address = "1";
  EXPECT_FALSE(FreeAddress(lonely, std::span(&device, 1)));
}

}  // namespace
}  // namespace baudgate
