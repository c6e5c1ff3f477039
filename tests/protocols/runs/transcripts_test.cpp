// Plays every golden transcript of tests/transcripts against the protocol that its name begins
// with.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "protocols/dcon/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"
#include "tests/support/transcript.h"

namespace baudgate {
namespace {

constexpr char kFolder[] = "tests/transcripts";  // tests run at the root of the source tree

/// The player makes every point writable and every '_' in `read` a blank. Here points are read
/// only, and decoders (from the first small letter on) have their underscores back: "float_le".
config::Point AsInProfile(config::Point point) {
  point.access = config::Access::read;
  const auto decoder = point.read.find_first_of("abcdefghijklmnopqrstuvwxyz");
  const auto from = static_cast<std::ptrdiff_t>(std::min(decoder, point.read.size()));
  std::replace(point.read.begin() + from, point.read.end(), ' ', '_');
  return point;
}

using Descriptor = const Protocol& (*)();

template <Descriptor kReal>
class TranscriptBus final : public Bus {
 public:
  std::unique_ptr<Conversation> MakeConversation(const config::Device& device) override {
    device_ = device;
    for (config::Point& point : device_.points) point = AsInProfile(std::move(point));
    return bus_->MakeConversation(device_);
  }

 private:
  std::unique_ptr<Bus> bus_ = kReal().make_bus({});
  config::Device device_;
};

template <Descriptor kReal>
const Protocol* ForTranscripts() {
  static const Protocol protocol = [] {
    Protocol changed = kReal();
    changed.check_point = [](const config::Point& point) {
      return kReal().check_point(AsInProfile(point));
    };
    changed.make_bus = [](const config::Line&) -> std::unique_ptr<Bus> {
      return std::make_unique<TranscriptBus<kReal>>();
    };
    return changed;
  }();
  return &protocol;
}

const Protocol* ProtocolOf(const std::string& name) {
  if (name == "spabus") return ForTranscripts<SpabusProtocol>();
  if (name == "dcon") return ForTranscripts<DconProtocol>();
  return name == "set4tm" ? ForTranscripts<Set4tmProtocol>() : nullptr;
}

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
  const Protocol* protocol = ProtocolOf(PrefixOf(GetParam()));
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
  EXPECT_EQ(prefixes, (std::set<std::string>{"dcon", "set4tm", "spabus"}));
}

}  // namespace
}  // namespace baudgate
