// Tests that the frame rules for requests, and for replies with every variant of the checksum, keep
// the laws in protocols/frame_rule.h.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/reply.h"
#include "protocols/spabus/rules.h"
#include "tests/laws/frame_rule_laws.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols {
namespace {

namespace spa = protocols::spabus;

Bytes WithoutLeadingLf(const std::optional<Bytes>& reply) {
  return Bytes(reply->begin() + 1, reply->end());
}

/// Returns 330 characters of values, which fill two lines.
std::string LongData() {
  std::string data = "10.25";
  for (int i = 0; i < 54; ++i) data += "/" + std::to_string(1000 + 37 * i % 613) + ".5"[i % 2];
  return data;
}

/// The bytes from `<` to the last colon, because checksum and line end have several forms.
Bytes ReplyEssence(View frame) {
  const std::string_view text = AsText(frame);
  return ToBytes(text.substr(0, text.rfind(':') + 1));
}

Bytes Noise(std::mt19937& random) {
  static const std::vector<std::string> kPieces = {"\n",
                                                   "\r\n",
                                                   ">1RF:21\r",
                                                   ">2RI1/5:",
                                                   "<1D:0.52/0.4",
                                                   "<1A",
                                                   "<1N:5:7",
                                                   "<3D:1.00/2&\r\n",
                                                   "<",
                                                   "<12",
                                                   "XX",
                                                   ":",
                                                   "&\r\n0/4.0",
                                                   "noise",
                                                   "\x01\x7f",
                                                   "\xff\xfe\x80",
                                                   "<1D:0.5&0:",
                                                   "SPAJ"};
  std::string noise;
  for (std::size_t i = random() % 6; i > 0; --i) noise += kPieces[random() % kPieces.size()];
  return ToBytes(noise);
}

LawSubject Reply(const std::string& name, int reading, int accepted) {
  LawSubject subject;
  subject.name = name;
  subject.rule = spa::ReplyRule;
  subject.expect.max_bytes = spa::kMaxReply;
  subject.expect.checksum = accepted;
  subject.frames = {WithoutLeadingLf(spa::EncodeData(1, "0.52/0.49/0.51/0.00/0", reading)),
                    WithoutLeadingLf(spa::EncodeData(899, " SPAJ 142C", reading)),
                    WithoutLeadingLf(spa::EncodeData(12, "", reading)),
                    WithoutLeadingLf(spa::EncodeAck(1, reading)),
                    WithoutLeadingLf(spa::EncodeNack(1, 5, reading))};
  subject.garbage = Noise;
  subject.essence = ReplyEssence;
  return subject;
}

LawSubject Continued(const std::string& name, int reading, int accepted) {
  LawSubject subject = Reply(name, reading, accepted);
  subject.frames = {WithoutLeadingLf(spa::EncodeData(3, LongData(), reading))};
  return subject;
}

LawSubject Wildcard() {
  LawSubject subject = Reply("wildcard", spa::kCoversAll, spa::kCoversAny | spa::kWildcardAccepted);
  for (Bytes& frame : subject.frames) {
    const std::size_t checksum = frame.size() - 4;
    frame[checksum] = frame[checksum + 1] = 'X';
  }
  subject.checksum = false;
  return subject;
}

/// The rule for requests delivers a request with a wrong checksum, because the device answers it
/// with NACK 0.
LawSubject Requests() {
  LawSubject subject;
  subject.name = "requests";
  subject.rule = spa::RequestRule;
  subject.expect.max_bytes = spa::kMaxLine + 1;
  subject.frames = {ToBytes(">1RF:21\r"), ToBytes(">2RI1/5:06\r"), ToBytes(">1WV160:1:08\r"),
                    ToBytes(">899R14V1:XX\r")};
  subject.garbage = [](std::mt19937& random) {
    static const std::vector<std::string> kPieces = {
        "\n<1D:0.5:0C\r\n", "\r\n", "\x80\xff", ">1R", ">900WT:12.3", "noise", ">", "\n<1A:76"};
    std::string noise;
    for (std::size_t i = random() % 6; i > 0; --i) {
      noise += kPieces[random() % kPieces.size()];
      if (noise.ends_with("R") || noise.ends_with("3") || noise.ends_with(">")) noise += "<\x01";
    }
    return ToBytes(noise);
  };
  subject.checksum = false;
  return subject;
}

std::vector<LawSubject> Subjects() {
  using namespace protocols::spabus;  // NOLINT: the bits of the checksum
  std::vector<LawSubject> subjects = {
      Reply("one_line", kCoversAll, kCoversAny),
      Reply("line_feed_covered", kCoversAll | kLineFeedCovered, kCoversAny | kLineFeedCovered),
      Continued("continued_a", kCoversAll, kCoversAll),
      Continued("continued_b", kCoversNoLineEnds, kCoversNoLineEnds),
      Continued("continued_c", kCoversCharacters, kCoversCharacters),
      Continued("continued_d", kCoversLastLine, kCoversLastLine),
      Wildcard(),
      Requests()};
  for (LawSubject& subject : subjects) {
    // The checksum of "continued_d" covers only its last line.
    if (subject.name == "continued_d") subject.checksum = false;
    std::erase(subject.name, '_');
  }
  return subjects;
}

using ::testing::ValuesIn;
INSTANTIATE_TEST_SUITE_P(Spabus, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Spabus, ChecksumLaws, ValuesIn(WithChecksum(Subjects())), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Spabus, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

}  // namespace
}  // namespace baudgate::protocols
