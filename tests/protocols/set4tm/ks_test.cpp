// The one-byte checksum KS of old SET-4TM meters: FF xor all bytes, frames one byte shorter.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/rules.h"
#include "protocols/set4tm/session.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

config::Options WithKs() {
  config::Options options = DefaultOptions();
  options.Set("checksum", std::string("ks"));
  return options;
}

TEST(Set4tmKs, IsFfXorAllBytes) {
  EXPECT_EQ(ToHex(MakeFrame(Hex("00"), Hex("00"), Checksum::ks)), "00 00 FF");
  // FF ^ 05 ^ 08 = F2; FF ^ 05 ^ 05 = FF
  EXPECT_EQ(ToHex(MakeFrame(Hex("05"), Hex("08 00"), Checksum::ks)), "05 08 00 F2");
  EXPECT_EQ(ToHex(MakeFrame(Hex("05"), Hex("05"), Checksum::ks)), "05 05 FF");
  EXPECT_TRUE(SplitFrame(Hex("05 08 00 F2"), Checksum::ks));
  EXPECT_FALSE(SplitFrame(Hex("05 08 00 F3"), Checksum::ks));
  EXPECT_FALSE(SplitFrame(Hex("05 08 00 66 01"), Checksum::ks));
  EXPECT_FALSE(SplitFrame(Hex("05 08 00 F2")));
  EXPECT_FALSE(EndsInChecksum(Hex("FF"), Checksum::ks)) << "of nothing";
}

TEST(Set4tmKs, AnyOneBitTurnedIsFound) {
  const Bytes good = MakeFrame(Hex("05"), Hex("00 00 27 11 00 00 13 89"), Checksum::ks);
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_FALSE(EndsInChecksum(bad, Checksum::ks)) << bit;
  }
}

TEST(Set4tmKs, HidesThePasswordAndItsChecksum) {
  const Expectation expect = Expect(MakeFrame(Hex("05"), Hex("01 30 30 30 30 30 31"), Checksum::ks),
                                    ReadSettings(WithKs()));
  ASSERT_EQ(expect.secrets.size(), 1U);
  EXPECT_EQ(expect.secrets[0], (std::pair<std::size_t, std::size_t>{2, 7}));
}

TEST(Set4tmKs, AStatusIsThreeBytesAndWaitsForSilence) {
  const Expectation expect = Expect(Hex("05 08 00 F2"), ReadSettings(WithKs()));
  const Bytes status = Hex("05 05 FF");
  EXPECT_EQ(ReplyRule(status, expect, false).kind, Cut::Kind::need_more);
  EXPECT_EQ(ReplyRule(status, expect, true).size, 3U);
  const Bytes whole = MakeFrame(Hex("05"), Hex("00 89 A2 61 06 09 02"), Checksum::ks);
  EXPECT_EQ(ReplyRule(whole, expect, false).size, whole.size());
  Bytes lengthened = status;
  lengthened.resize(whole.size());  // zeros keep KS good
  EXPECT_EQ(ReplyRule(lengthened, expect, true).kind, Cut::Kind::discard);
}

/// What it answers is for the status alone: the other checksum fits some damaged replies, too.
TEST(Set4tmKs, ASilentMeterIsAskedInTheOtherChecksumNowAndThen) {
  config::Device device = MakeDevice("5", {MakePoint(kOneFloat)});
  device.options.Set("checksum", std::string("ks"));
  Talk talk(Set4tmProtocol(), device);
  std::vector<Bytes> in_other;
  for (int probe = 0; probe < 12; ++probe) {
    const Bytes request = talk.Ask(Probe())->bytes;
    if (EndsInChecksum(request, Checksum::crc)) in_other.push_back(request);
    talk.Fail(Probe(), Outcome::no_reply);
  }
  ASSERT_EQ(in_other.size(), 3U);
  EXPECT_EQ(in_other[0], MakeFrame(Hex("05"), Hex("08 00"), Checksum::crc));
  const auto found = Recognise(in_other[0], MakeFrame(Hex("05"), Hex("05"), Checksum::crc),
                               ReadSettings(WithKs()));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->what, Recognised::What::other_setting);
  EXPECT_EQ(found->remedy, "set checksum: crc in the configuration");

  talk.Run(Probe(), [](View) { return MakeFrame(Hex("05"), Hex("00"), Checksum::ks); });
  for (int probe = 0; probe < 8; ++probe) {
    EXPECT_FALSE(EndsInChecksum(talk.Ask(Probe())->bytes, Checksum::crc)) << "it has answered";
    talk.Fail(Probe(), Outcome::no_reply);
  }
}

TEST(Set4tmKs, AnotherSerialNumberMustComeTwice) {
  Settings settings;
  settings.serial_number = 7;
  settings.checksum = Checksum::ks;
  MeterSession session(settings);
  EXPECT_FALSE(session.Doubts(7));
  EXPECT_TRUE(session.Doubts(9)) << "it may be damaged";
  EXPECT_FALSE(session.Doubts(9));
  session.OnTaskEnd();
  for (const std::uint32_t serial : {11U, 12U, 13U}) EXPECT_TRUE(session.Doubts(serial));
  EXPECT_FALSE(session.Doubts(14)) << "not without an end";
  settings.checksum = Checksum::crc;
  session.OnTaskEnd();
  EXPECT_FALSE(session.Doubts(9));
}

TEST(Set4tmKs, MeterAndTwinSpeakIt) {
  config::Device device = MakeDevice("5", {MakePoint("05 00 02 energy@0")});
  device.options.Set("checksum", std::string("ks"));
  device.options.Set("types", std::vector<std::string>{"0"});
  FixedValues values;
  values.Set(0, 1.0001);
  MeterTwin twin(device, values);
  Talk talk(Set4tmProtocol(), device);
  const Answer answer = talk.Run(Poll(0), twin);
  ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  EXPECT_EQ(answer.readings.at(0).value, Value(1.0001));
  EXPECT_EQ(ToHex(talk.asked.back()), "05 05 00 02 FD");
}

TEST(Set4tmKs, AMeterWithTheOtherChecksumIsSilentOrCorrupt) {
  config::Device device = OneFloat();
  FixedValues values;
  MeterTwin with_crc(device, values);
  config::Device old = device;
  old.options.Set("checksum", std::string("ks"));
  Talk talk(Set4tmProtocol(), old);
  EXPECT_NE(talk.Run(Poll(0), with_crc).outcome, Outcome::ok);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
