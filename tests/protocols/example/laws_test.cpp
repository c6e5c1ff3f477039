// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/codec.h"
#include "protocols/example/rules.h"
#include "tests/laws/frame_rule_laws.h"

namespace baudgate {
namespace {

using ::testing::ValuesIn;

std::vector<LawSubject> Subjects() {
  namespace example = protocols::example;
  const auto noise = [](std::mt19937& random) {
    constexpr std::string_view kNoise = "A7=5*0B~\x01\x80";
    Bytes bytes(random() % 40);
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(kNoise[random() % kNoise.size()]);
    }
    return bytes;
  };
  LawSubject replies;
  replies.name = "Replies";
  replies.rule = example::ReplyRule;
  replies.expect.max_bytes = example::kMaxFrame;
  replies.frames = {example::EncodeReply({'!', 'A', 7, "=5"}),
                    example::EncodeReply({'!', 'Z', 999, "=-12.75"}),
                    example::EncodeReply({'!', 'A', 7, "~"})};
  replies.garbage = noise;
  LawSubject requests = replies;
  requests.name = "Requests";
  requests.rule = example::RequestRule;
  requests.frames = {example::EncodeRequest({'?', 'A', 7, {}}),
                     example::EncodeRequest({'W', 'A', 7, "=5"})};
  requests.checksum = false;
  return {replies, requests};
}

INSTANTIATE_TEST_SUITE_P(Example, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Example, ChecksumLaws, ValuesIn(WithChecksum(Subjects())), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Example, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

}  // namespace
}  // namespace baudgate
