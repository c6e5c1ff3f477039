// A password that a slip made part of something else is in no message.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/model/problem.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Secrets, AKeyThatIsNoneIsShownAsFarAsItLooksLikeOne) {
  const struct {
    const char* keys;
    const char* problem;
  } kCases[] = {
      {"password:SEC_RET", "'password…' in device 'd'; is the blank after the colon missing?"},
      {"\"password:SEC_RET\": 1", "'password…' in device 'd'; is the blank after the colon"},
      {"password SEC_RET", "'password…' in device 'd'; is a colon missing?"},
      {"pasword:SEC_RET", "'pasword…' in device 'd'; is the blank after the colon missing?"},
      {"password=SEC_RET", "'password…' in device 'd';"},
      {"passwordSEC_RET", "'password…' in device 'd';"},
      {"PASSWORDSEC_RET: 1", "'PASSWORD…' in device 'd';"},
      {"adress: 2", "'adress' in device 'd'; did you mean 'address'?"},
  };
  for (const auto& one : kCases) {
    const std::string problems = ProblemsOfDevice(one.keys);
    EXPECT_THAT(problems, StartsWith("t.yaml:6:28: error: unknown key " + std::string(one.problem)))
        << one.keys;
    EXPECT_THAT(problems, Not(HasSubstr("RET"))) << one.keys;
  }
}

TEST(Secrets, ACommaEndsAValueInBraces) {
  EXPECT_THAT(ProblemsOfDevice("password: SEC,RET"),
              "t.yaml:6:42: error: a key without a value stands behind 'password' in device 'd'; "
              "put a value with a comma in quotes\n");
}

TEST(Secrets, WhatHasSwallowedThemIsNotShown) {
  for (const char* const keys :
       {"unit: 1 password:SEC_RET", "poll: 1s password: SEC_RET", "mode: fast password SEC'RET",
        "profile: relay\n      password:SEC_RET", "mode: passwordSEC_RET", "password: {SEC_RET: 1}",
        "password: [SEC_RET]", "password: &SEC_RET", "password: !SEC_RET", "password: *SEC_RET",
        "password:SEC_RET, password:SEC_RET", "password: SEC_RET, password: SEC_RET"}) {
    const std::string problems = ProblemsOfDevice(keys);
    EXPECT_THAT(problems, HasSubstr("error")) << keys;
    EXPECT_THAT(problems, Not(HasSubstr("RET"))) << problems;
  }
}

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

TEST(Secrets, UnquotedSignsOfYamlGetAHint) {
  EXPECT_EQ(ProblemsOfDevice("password: &SECRET"),
            "t.yaml:6:28: error: password: has no value; one that begins with '&' needs quotes\n");
  EXPECT_EQ(ProblemsOfDevice("password: !SECRET"),
            "t.yaml:6:38: error: password: a value that begins with '!' needs quotes\n");
}

TEST(Secrets, AreNotAmongTheOptionsThatAreRepeatedElsewhere) {
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
