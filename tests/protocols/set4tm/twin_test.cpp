// Tests the simulated SET-4TM meter: its answers and its silence.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin/twin.h"

#include <gtest/gtest.h>

#include <memory>

#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/session.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using config::Type;

class Set4tmTwin : public ::testing::Test {
 protected:
  Set4tmTwin()
      : device_(MakeDevice("5",
                           {MakePoint("08 1B 02 10 float_le@4"), MakePoint("05 00 00 energy@0"),
                            MakePoint("04 00 time@0", Group::fast, Type::string),
                            MakePoint("08 0A flag@40", Group::fast, Type::boolean),
                            MakePoint("08 02 u16_be@0"), MakePoint("08 02 u16_be@2")},
                           {{"snapshot", std::string("auto")}})) {
    device_.options.Set("serial_number", std::int64_t{9020001});
    values_.Set(0, 230.5);
    values_.Set(1, 2000.2);
    values_.Set(2, std::string("2002-09-02T15:30:31"));
    values_.Set(3, true);
    values_.Set(4, std::int64_t{100});
    values_.Set(5, std::int64_t{20});
  }

  std::string Ask(std::string_view address, std::string_view pdu) {
    return ToHex(twin_->Answer(MakeFrame(Hex(address), Hex(pdu)), now_));
  }
  std::string Frame(std::string_view address, std::string_view body) {
    return ToHex(MakeFrame(Hex(address), Hex(body)));
  }
  void Open() { ASSERT_EQ(Ask("05", "01 30 30 30 30 30 30"), "05 00 02 E0"); }

  config::Device device_;
  FixedValues values_;
  std::unique_ptr<MeterTwin> twin_ = std::make_unique<MeterTwin>(device_, values_);
  Instant now_{std::chrono::hours(1)};
};

TEST_F(Set4tmTwin, IsSilentToDamageAndOtherAddresses) {
  Bytes damaged = Hex("05 08 00 66 01");
  damaged[1] ^= 1;
  EXPECT_TRUE(twin_->Answer(damaged, now_).empty());
  EXPECT_EQ(Ask("06", "00"), "");
  EXPECT_EQ(Ask("FE", "03 08 55 AA 33 CC"), "");
  EXPECT_EQ(Ask("FC 00 89 A2 62", "00"), "");
  EXPECT_EQ(Ask("05", "08 00 00 00"), "");
  EXPECT_EQ(Ask("00", "03 0B 00 0A"), "");
  EXPECT_EQ(Ask("05", "00"), Frame("05", "00"));
}

TEST_F(Set4tmTwin, RefusesAClockCorrectionAcrossALocalHour) {
  // 10:00:04 UTC is 15:45:04 in this zone.
  device_.options.Set("time_zone", std::string("+05:45"));
  twin_ = std::make_unique<MeterTwin>(device_, values_);
  const auto day = std::chrono::sys_days(std::chrono::year(2026) / 1 / 27);
  twin_->SetClock({now_, WallTime(day) + 10h + 4s});
  Open();
  EXPECT_EQ(Ask("05", "03 0B FF C4"), Frame("05", "00")) << "a minute back, over an hour of UTC";
  EXPECT_EQ(Ask("05", "03 0B FF C4"), Frame("05", "04")) << "once a day";
  twin_->SetClock({now_, WallTime(day) + 24h + 10h + 15min + 4s + 60s});
  EXPECT_EQ(Ask("05", "03 0B FF C4"), Frame("05", "01")) << "over one of its own";
}

TEST_F(Set4tmTwin, RepliesUnderAnotherAddressIfConfigured) {
  twin_->ReplyAs("6");
  EXPECT_EQ(Ask("05", "00"), Frame("06", "00"));
  EXPECT_EQ(Ask("FC 00 89 A2 61", "00"), Frame("06", "00"));
  EXPECT_EQ(Ask("06", "00"), "") << "it is still called 5";
  twin_->ReplyAs("sn:1");
  EXPECT_EQ(Ask("05", "00"), Frame("FC 00 00 00 01", "00"));
}

TEST_F(Set4tmTwin, ItsChannelNeedsThePasswordAndExpiresAfter20Seconds) {
  EXPECT_EQ(Ask("05", "08 00"), "05 05 C2 E3");
  EXPECT_EQ(Ask("05", "01 30 30 30 30 30 31"), Frame("05", "03"));
  EXPECT_EQ(Ask("05", "08 00"), "05 05 C2 E3");
  Open();
  now_ += 20s;
  EXPECT_EQ(Ask("05", "08 00"), "05 00 89 A2 61 06 09 02 1E D8");
  now_ += 20s;
  EXPECT_EQ(Ask("05", "08 00"), "05 00 89 A2 61 06 09 02 1E D8");
  now_ += 21s;
  EXPECT_EQ(Ask("05", "08 00"), "05 05 C2 E3");
  Open();
  EXPECT_EQ(Ask("05", "02"), Frame("05", "00"));
  EXPECT_EQ(Ask("05", "08 00"), "05 05 C2 E3");
}

TEST_F(Set4tmTwin, AnswersAtItsExtendedAndTheCommonAddress) {
  Open();
  EXPECT_EQ(Ask("FC 00 89 A2 61", "08 00"), "FC 00 89 A2 61 00 89 A2 61 06 09 02 58 BB");
  EXPECT_EQ(Ask("00", "08 05"), Frame("05", "00 05"));
  EXPECT_EQ(Ask("05", "08 05 01"), Frame("05", "00 89 A2 61"));
}

TEST_F(Set4tmTwin, EncodesLikeTheMeter) {
  Open();
  // 2000.2 kWh = 10001 / (2 * 5000) * 100 * 20
  EXPECT_EQ(Ask("05", "05 00 00"), Frame("05", "00 00 27 11 00 00 00 00 00 00 00 00 00 00 00 00"));
  EXPECT_EQ(Ask("05", "04 00"), "05 31 30 15 01 02 09 02 00 28 A4");
  EXPECT_EQ(Ask("05", "08 0A"), Frame("05", "00 00 00 00 80"));
  EXPECT_EQ(Ask("05", "08 02"), Frame("05", "00 64 00 14 00 00 00 00 00 00"));
  EXPECT_EQ(Ask("05", "08 12"), Frame("05", "10 40 80"));
}

TEST_F(Set4tmTwin, ReturnsAFloatForEveryRequestThatNamesIt) {
  Open();
  EXPECT_EQ(Ask("05", "08 1B 00 11"), Frame("05", "00 80 66 43"));
  EXPECT_EQ(Ask("05", "08 1B 02 10"),
            Frame("05", "00 80 66 43 00 80 66 43 01 00 80 7F 01 00 80 7F"));
  EXPECT_EQ(Ask("05", "08 23 A5 00 00 00 00 00 00 02 00 00"), Frame("05", "A5 00 80 66 43"));
  EXPECT_EQ(Ask("05", "08 1B 00 21"), Frame("05", "01"));
  EXPECT_EQ(Ask("05", "08 23 A5 02 00 00 00 00 00 02 00 00"), Frame("05", "01"));
}

TEST_F(Set4tmTwin, SupportsTheRequestsOfItsType) {
  const auto ask = [&](const char* type, const char* snapshot, std::string_view pdu) {
    config::Device device = device_;
    device.options.Set("types", std::vector<std::string>{type});
    device.options.Set("snapshot", std::string(snapshot));
    MeterTwin twin(device, values_);
    twin.Answer(MakeFrame(Hex("05"), Hex("01 30 30 30 30 30 30")), now_);
    return ToHex(twin.Answer(MakeFrame(Hex("05"), Hex(pdu)), now_));
  };
  constexpr const char* kMasked = "08 23 A5 00 00 00 00 00 00 02 00 00";
  EXPECT_EQ(ask("1", "auto", "08 12"), Frame("05", "10 40 10"));
  EXPECT_EQ(ask("1", "auto", "08 1B 00 11"), Frame("05", "00 80 66 43"));
  EXPECT_EQ(ask("1", "auto", kMasked), Frame("05", "A5 00 80 66 43"));
  EXPECT_EQ(ask("1", "false", kMasked), Frame("05", "01")) << "older firmware";
  EXPECT_EQ(ask("0", "auto", "08 12"), Frame("05", "10 40 00"));
  EXPECT_EQ(ask("0", "auto", "08 1B 00 11"), Frame("05", "01"));
  EXPECT_EQ(ask("0", "auto", kMasked), Frame("05", "01"));
}

TEST_F(Set4tmTwin, CorrectsItsClockOnceADayAndWritesNothingElse) {
  EXPECT_EQ(Ask("05", "03 0B 00 0A"), "05 05 C2 E3");
  Open();
  EXPECT_EQ(Ask("05", "03 0B 01 00"), Frame("05", "01"));
  EXPECT_EQ(Ask("05", "03 0B 00 0A"), "05 00 02 E0");
  EXPECT_EQ(Ask("05", "03 0B 00 0A"), "05 04 03 23");
  EXPECT_EQ(Ask("05", "03 1B 00 01"), Frame("05", "03"));
}

TEST_F(Set4tmTwin, SupportsOnlyItsOwnParameters) {
  Open();
  EXPECT_EQ(Ask("05", "08 0B"), Frame("05", "01"));
  EXPECT_EQ(Ask("05", "08 7F"), Frame("05", "01"));
  EXPECT_EQ(Ask("05", "0B 01"), Frame("05", "01"));
}

const Bytes kPassword = ToBytes("000000");

Now Earlier(Duration since) { return {Instant(5h) + since, WallTime(1'790'000'000s) + since}; }

/// Returns the clocks of a later process, whose monotonic clock has another zero.
Now Later(Duration since) { return {Instant(7min) + since, WallTime(1'790'000'000s) + since}; }

TEST(MeterMemory, TheFirstSerialNumberIsStored) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  EXPECT_EQ(memory.text(), "");
  memory.OnSerial(12345678);
  EXPECT_EQ(memory.text(), "serial 12345678");
  MeterMemory next(kPassword);
  next.Recall(memory.text(), Later(1min));
  EXPECT_EQ(next.serial(), 12345678U);
  next.OnEnabled();
  EXPECT_EQ(next.serial(), std::nullopt);
  EXPECT_EQ(next.text(), "");
}

TEST(MeterMemory, ARefusedPasswordIsRetriedOnceAfterAnHour) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  EXPECT_TRUE(memory.MayTry(Earlier(0s).instant));
  memory.OnRefused(Earlier(0s).instant);
  EXPECT_FALSE(memory.MayTry(Earlier(59min).instant));
  EXPECT_EQ(memory.Wait(Earlier(20min).instant), 40min);
  EXPECT_TRUE(memory.MayTry(Earlier(60min).instant));
  memory.OnRefused(Earlier(60min).instant);
  EXPECT_FALSE(memory.MayTry(Earlier(48h).instant));
  EXPECT_TRUE(memory.given_up());
  memory.OnEnabled();
  EXPECT_TRUE(memory.MayTry(Earlier(48h).instant));
}

TEST(MeterMemory, RestartsDoNotShortenTheWait) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  memory.OnRefused(Earlier(0s).instant);
  MeterMemory second(kPassword);
  second.Recall(memory.text(), Later(10min));
  EXPECT_FALSE(second.MayTry(Later(59min).instant));
  EXPECT_TRUE(second.MayTry(Later(61min).instant));
  second.OnRefused(Later(61min).instant);
  MeterMemory third(kPassword);
  third.Recall(second.text(), Later(72h));
  EXPECT_TRUE(third.given_up());
  EXPECT_FALSE(third.MayTry(Later(72h).instant));
}

TEST(MeterMemory, AnotherPasswordMayBeTried) {
  MeterMemory memory(ToBytes("secret"));
  memory.Recall("serial 5", Earlier(0s));
  memory.OnRefused(Earlier(0s).instant);
  memory.OnRefused(Earlier(1h).instant);
  EXPECT_EQ(memory.text().find("secret"), std::string::npos);
  MeterMemory next(ToBytes("123456"));
  next.Recall(memory.text(), Later(2h));
  EXPECT_TRUE(next.MayTry(Later(2h).instant));
  EXPECT_EQ(next.serial(), 5U) << "it is still that meter's place";
  EXPECT_EQ(next.text(), "serial 5");
}

TEST(MeterMemory, AClockSetBackAllowsNoEarlierRetry) {
  MeterMemory memory(kPassword);
  memory.Recall("", Earlier(0s));
  memory.OnRefused(Earlier(0s).instant);
  MeterMemory next(kPassword);
  const Now in_1970{Instant(7min), WallTime(30s)};
  next.Recall(memory.text(), in_1970);
  EXPECT_FALSE(next.MayTry(in_1970.instant + 59min));
  EXPECT_TRUE(next.MayTry(in_1970.instant + 60min));
}

TEST(MeterMemory, InvalidTextIsIgnored) {
  for (const char* text : {"x", "serial", "serial -1", "serial 99999999999", "password", ";;;",
                           "password ZZ refused 1", "password 00 refused x y", "serial 1 2"}) {
    MeterMemory memory(kPassword);
    memory.Recall(text, Earlier(0s));
    EXPECT_EQ(memory.serial(), std::nullopt) << text;
    EXPECT_TRUE(memory.MayTry(Earlier(0s).instant)) << text;
  }
}

TEST(MeterMemory, StoresNothingWithoutAFile) {
  MeterMemory memory(kPassword);
  memory.OnSerial(5);
  memory.OnRefused(Instant(1h));
  EXPECT_EQ(memory.text(), "");
  EXPECT_EQ(memory.serial(), 5U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
