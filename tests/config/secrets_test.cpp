// Tests that no message contains a password, even if a typing error made it part of another value.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/model/problem.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

TEST(Secrets, AreHiddenInQuotationsOnly) {
  const auto shown = [](const std::string& message) {
    config::Problems problems;
    problems.AddSecret("password");
    problems.Error({}, message);
    return problems.Sorted().at(0).message;
  };
  EXPECT_EQ(shown("address \"1 password:SEC\" is none"), "address \"1 password…\" is none");
  EXPECT_EQ(shown("'1 password: S'E C' is none"), "'1 password…' is none");
  EXPECT_EQ(shown("'password:A' and 'password:B'"), "'password…'");
  for (const char* const harmless :
       {"the password must be 6 characters", "allowed: password, pin", "password: the value is bad",
        "the value after 'password:' in line 8 begins with '%'", "'password' belongs to the line",
        "'nopassword:x' is none"}) {
    EXPECT_EQ(shown(harmless), harmless);
  }
}

TEST(Secrets, AreNotAmongTheWrittenOptions) {
  const config::Loaded loaded = Load(
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1,\n"
      "    profile: relay, password: hush, pin: 4711, width: 9, tags: [a, b] }] }\n");
  ASSERT_TRUE(loaded.ok()) << Shown(loaded.problems);
  const auto& written = loaded.config.lines.at(0).devices.at(0).options.written();
  EXPECT_EQ(written.at("width"), "9");
  EXPECT_EQ(written.at("tags"), "a,b");
  EXPECT_FALSE(written.contains("password"));
  EXPECT_FALSE(written.contains("pin"));
}

}  // namespace
}  // namespace baudgate::testing
