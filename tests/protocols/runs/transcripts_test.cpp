// Plays every golden transcript of tests/transcripts against the protocol that its name begins
// with.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/config/shipped.h"
#include "tests/support/transcript.h"

namespace baudgate {
namespace {

constexpr char kFolder[] = "tests/transcripts";  // tests run at the root of the source tree

std::vector<std::string> Files() {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder, error)) {
    files.push_back(entry.path().filename().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string PrefixOf(const std::string& file) { return file.substr(0, file.find('-')); }

class GoldenTranscript : public ::testing::TestWithParam<std::string> {};

TEST_P(GoldenTranscript, IsPlayed) {
  ASSERT_TRUE(GetParam().ends_with(".transcript")) << "no transcript: " << GetParam();
  const Protocol* protocol = testing::Shipped().FindProtocol(PrefixOf(GetParam()));
  ASSERT_NE(protocol, nullptr) << "no protocol of this name: " << GetParam();
  PlayTranscript(*protocol, std::string(kFolder) + "/" + GetParam());
}

INSTANTIATE_TEST_SUITE_P(Files, GoldenTranscript, ::testing::ValuesIn(Files()),
                         [](const ::testing::TestParamInfo<std::string>& info) {
                           std::string name = info.param.substr(0, info.param.find('.'));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(GoldenTranscript);

/// An empty or missing folder would otherwise be a suite without tests, which passes.
TEST(GoldenTranscripts, EveryProtocolHasSome) {
  std::set<std::string> prefixes;
  for (const std::string& file : Files()) prefixes.insert(PrefixOf(file));
  std::set<std::string> protocols;
  for (const auto& [name, protocol] : testing::Shipped().protocols) protocols.insert(name);
  EXPECT_EQ(prefixes, protocols);
}

}  // namespace
}  // namespace baudgate
