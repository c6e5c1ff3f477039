// Which function codes the clients of a listener may ask for.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/outputs/modbus/service/client_requests.h"

namespace baudgate::modbus {
namespace {

TEST(Permission, ByFunction) {
  const auto allowed = [](config::Permit permit) {
    std::string codes;
    for (int code = 0; code < 256; ++code) {
      if (Permits(permit, static_cast<std::uint8_t>(code))) codes += std::to_string(code) + " ";
    }
    return codes;
  };
  EXPECT_EQ(allowed(config::Permit::read), "1 2 3 4 ");
  EXPECT_EQ(allowed(config::Permit::data), "1 2 3 4 5 6 15 16 ");
  EXPECT_TRUE(Permits(config::Permit::all, 100));
}

}  // namespace
}  // namespace baudgate::modbus
