// Tests that a configuration with random changes is either loaded or refused with problems.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "config/loader.h"
#include "config/yaml/yaml_source.h"
#include "gateway/tools/cli/offline/check_parts.h"
#include "tests/config/fake_protocol.h"
#include "tests/support/long_run.h"

namespace baudgate::testing {
namespace {

constexpr std::string_view kBytes = "{}[]:,-#&*!|>'\"%@` \t\n\r~?0179azAZ_.\\\xC2\xB0\xFF";

const config::Catalog& ExampleCatalog() {
  static const protocols::Protocol kSpabus = MakeFakeProtocol("spabus");
  static const protocols::Protocol kDcon = MakeFakeProtocol("dcon");
  static const protocols::Protocol kSet4tm = MakeFakeProtocol("set4tm");
  static const protocols::Protocol kRtu = MakeFakeCarrier("modbus_rtu");
  static const config::Catalog kCatalog = {
      {{"spabus", &kSpabus}, {"dcon", &kDcon}, {"set4tm", &kSet4tm}, {"modbus_rtu", &kRtu}},
      {},
      {"tests/config/profiles"}};
  return kCatalog;
}

std::string Example(const std::string& name) {
  const auto text = config::ReadWholeFile("config/examples/" + name);
  EXPECT_TRUE(text);
  return text ? *text : std::string();
}

void ExpectConsistent(const std::string& text) {
  const auto loaded = config::LoadText(text, "m.yaml", ExampleCatalog());
  for (const auto& problem : loaded.problems) {
    ASSERT_FALSE(problem.message.empty());
    ASSERT_GE(problem.mark.line, 0);
  }
  if (loaded.ok()) {
    for (const auto& line : loaded.config.lines) ASSERT_FALSE(line.port.empty());
    std::ostringstream out;
    tools::PrintRouteTable(loaded.config, out);
  }
}

class Mutation : public ::testing::TestWithParam<const char*> {};

TEST_P(Mutation, EveryTruncationGivesAConsistentResult) {
  const std::string example = Example(GetParam());
  for (std::size_t size = 0; size < example.size(); size += 7) {
    ExpectConsistent(example.substr(0, size));
  }
}

TEST_P(Mutation, RandomDamageGivesAConsistentResult) {
  const std::string example = Example(GetParam());
  std::mt19937 random(20261121);
  const auto below = [&](std::size_t limit) { return random() % limit; };
  for (std::size_t round = 0; round < LongRun(1500); ++round) {
    std::string text = example;
    for (std::size_t hits = 1 + below(4); hits > 0; --hits) {
      const std::size_t at = below(text.size());
      const char byte = kBytes[below(kBytes.size())];
      switch (below(5)) {
        case 0:
          text[at] = byte;
          break;
        case 1:
          text.insert(at, 1, byte);
          break;
        case 2:
          text.erase(at, 1 + below(20));
          break;
        case 3:
          text.insert(at, text.substr(below(text.size()), below(200)));
          break;
        default:
          text.insert(at, 1 + below(50), byte);
          break;
      }
    }
    ExpectConsistent(text);
  }
}

INSTANTIATE_TEST_SUITE_P(Examples, Mutation, ::testing::Values("baudgate.yaml", "digi-one.yaml"));

}  // namespace
}  // namespace baudgate::testing
