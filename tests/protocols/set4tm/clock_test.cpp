// Tests the clock of a meter as a number.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/clock.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/points.h"
#include "protocols/set4tm/meter/values.h"
#include "tests/protocols/set4tm/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::set4tm {
namespace {

Scale In(std::string_view zone) {
  Scale scale;
  if (!zone.empty()) scale.zone = CivilZone::Parse(zone).value();
  return scale;
}

Decoded ReadClock(std::string_view data, std::string_view zone,
                  const char* read = "04 00 clock@0") {
  return DecodeField(ParseField(read).value(), ParseHex(data).value(), In(zone));
}

std::string ShownUtc(const Decoded& decoded) {
  EXPECT_EQ(decoded.quality, Quality::good);
  const auto* seconds = std::get_if<std::uint64_t>(&decoded.value);
  if (seconds == nullptr) return "none";
  return FormatWallTime(WallTime(std::chrono::seconds(*seconds))).substr(0, 19);
}

// SET-4TM reference, example 8.
constexpr const char* kSummer = "31 30 15 01 02 09 02 00";

TEST(MeterClock, IsConvertedToUtcByItsZone) {
  EXPECT_EQ(ShownUtc(ReadClock(kSummer, "+03:00")), "2002-09-02T12:30:31");
  EXPECT_EQ(ShownUtc(ReadClock(kSummer, "+01:00 eu")), "2002-09-02T13:30:31");
  EXPECT_EQ(ShownUtc(ReadClock(kSummer, "+00:00", "09 00 00 clock@0")), "2002-09-02T15:30:31");
}

TEST(MeterClock, DistinguishesTheTwoHoursOfAutumn) {
  EXPECT_EQ(ShownUtc(ReadClock("00 30 02 07 25 10 26 00", "+01:00 eu")), "2026-10-25T00:30:00");
  EXPECT_EQ(ShownUtc(ReadClock("00 30 02 07 25 10 26 01", "+01:00 eu")), "2026-10-25T01:30:00");
}

TEST(MeterClock, HasNoValueWithoutAZone) {
  const Decoded decoded = ReadClock(kSummer, "");
  EXPECT_FALSE(HasValue(decoded.value));
  EXPECT_EQ(decoded.quality, (Quality{Quality::bad_configuration, Reason::not_fitted}));
}

TEST(MeterClock, HasNoValueForAnImpossibleDate) {
  for (const char* data : {"31 30 25 01 02 09 02 00", "31 30 15 01 31 02 02 00",
                           "00 00 00 00 00 00 00 00", "31 30 15 01 02 09"}) {
    const Decoded decoded = ReadClock(data, "+03:00");
    EXPECT_FALSE(HasValue(decoded.value)) << data;
    EXPECT_TRUE(IsBad(decoded.quality)) << data;
  }
}

TEST(MeterClock, IsEncodedAndDecoded) {
  const Field field = ParseField("04 00 clock@0").value();
  for (const char* zone : {"+03:00", "+01:00 eu", "-05:30"}) {
    for (std::uint64_t seconds = 1'790'000'000; seconds < 1'822'000'000; seconds += 1801) {
      Bytes data(8);
      ASSERT_TRUE(EncodeField(field, Value(seconds), In(zone), data));
      ASSERT_EQ(DecodeField(field, data, In(zone)).value, Value(seconds)) << zone;
    }
  }
}

TEST(MeterClock, IsAcceptedInItsOwnRequestOnly) {
  EXPECT_FALSE(ParseField("09 01 09 clock@0"));
  EXPECT_FALSE(ParseField("04 00 clock@1"));
}

constexpr Duration kCharacter = 1146us;  // 11 bits at 9600 bit/s

Scale InZone(std::string_view zone) {
  Scale scale;
  scale.zone = *CivilZone::Parse(zone);
  return scale;
}

/// 2002-09-02T15:30:31, summer time (MFR 2.4.1.1.1): 11:30:31 UTC in a zone of +04:00.
TEST(ClockDrift, IsMeasuredAtTheMiddleOfTheExchange) {
  const Bytes data = Hex("31 30 15 01 02 09 02 00");
  const WallTime shown = std::chrono::sys_days(std::chrono::year(2002) / 9 / 2) + 11h + 30min + 31s;
  ClockDrift drift;
  drift.OnHostClock(true);
  drift.OnAsked();
  const Instant sent{1h};
  drift.OnSent({sent, shown - 10s}, kCharacter);
  const Instant whole = sent + 40ms + 11 * kCharacter;
  const Decoded decoded = drift.Of(data, 11, InZone("+04:00"), whole);
  EXPECT_TRUE(IsGood(decoded.quality));
  EXPECT_NEAR(ToDouble(decoded.value), 10 + 0.5 - 0.02, 1e-6);
  EXPECT_TRUE(drift.Latest(whole + 59min));
  EXPECT_FALSE(drift.Latest(whole + 61min));
  drift.OnHostClock(false);
  EXPECT_FALSE(drift.Latest(whole));
  EXPECT_TRUE(IsUncertain(drift.Of(data, 11, InZone("+04:00"), whole).quality));
  EXPECT_TRUE(IsBad(drift.Of(data, 11, Scale(), whole).quality)) << "no zone";
}

TEST(ClockDrift, IsUncertainAfterALongExchange) {
  ClockDrift drift;
  drift.OnHostClock(true);
  drift.OnAsked();
  drift.OnSent({Instant(1h), WallTime(1'000'000'000s)}, kCharacter);
  drift.OnSent({Instant(1h + 2s), WallTime(1'000'000'002s)}, kCharacter);
  const Decoded decoded =
      drift.Of(Hex("31 30 15 01 02 09 02 00"), 11, InZone("+00:00"), Instant(1h + 2100ms));
  EXPECT_TRUE(IsUncertain(decoded.quality));
}

/// SET-4TM reference, 12, example 14: a correction by +10 s.
TEST(ClockDrift, CorrectionMatchesTheReference) {
  const ClockDrift drift;
  const auto pdu = ClockCorrection(Value(10.0), drift, Instant(1h));
  ASSERT_TRUE(pdu);
  EXPECT_EQ(ToHex(MakeFrame(Bytes{5}, *pdu)), "05 03 0B 00 0A 19 81");
  EXPECT_EQ(ToHex(*ClockCorrection(Value(std::int64_t{-120}), drift, Instant(1h))), "03 0B FF 88");
  EXPECT_FALSE(ClockCorrection(Value(121.0), drift, Instant(1h)));
  EXPECT_FALSE(ClockCorrection(Value(0.4), drift, Instant(1h))) << "whole seconds";
  EXPECT_FALSE(ClockCorrection(Value(0.0), drift, Instant(1h))) << "the try of the day for nothing";
  EXPECT_FALSE(ClockCorrection(Value(std::int64_t{-70'000}), drift, Instant(1h)));
  EXPECT_FALSE(ClockCorrection(Value(true), drift, Instant(1h))) << "no drift is known";
  EXPECT_FALSE(ClockCorrection(Value(false), drift, Instant(1h)));
}

TEST(ClockCare, RequiresItsPoints) {
  config::Device right = MakeDevice("5", {MakePoint("04 00 drift@0")});
  right.points[0].name = "clock_drift";
  config::Point correction;
  correction.name = "clock_correction";
  correction.write = "03 0B";
  correction.access = config::Access::write;
  correction.type = config::Type::boolean;
  correction.writing.allowed = true;
  right.points.push_back(correction);
  right.options.Set("time_zone", std::string("+03:00"));
  right.options.Set("correct_clock", std::int64_t{Duration(5s).count()});
  ASSERT_TRUE(Set4tmProtocol().check_device(right));
  ASSERT_TRUE(ClockCareOf(right));
  EXPECT_EQ(ClockCareOf(right)->least, 5s);
  EXPECT_EQ(ClockCareOf(right)->most, 60s);
  EXPECT_EQ(ClockCareOf(right)->correction, 1U);
  struct Row {
    std::function<void(config::Device&)> spoil;
    const char* says;
  };
  using Device = config::Device;
  const auto time = [](const char* name, Duration value) {
    return [=](Device& its) { its.options.Set(name, std::int64_t{value.count()}); };
  };
  const Row rows[] = {
      {time("correct_clock", 1s), "write a time from 2s to correct_clock_most"},
      {time("correct_clock", 61s), "write a time from 2s to correct_clock_most"},
      {time("correct_clock_most", 121s), "by at most 120s"},
      {[](Device& its) { its.options.Set("time_zone", std::string()); }, "time_zone"},
      {[](Device& its) { its.points[0].name = "drift"; }, "a point clock_drift"},
      {[](Device& its) { its.points[0].read = "04 00 time@0"; }, "a point clock_drift"},
      {[](Device& its) { its.points[0].scale = 0.1; }, "neither scale nor offset"},
      {[](Device& its) { its.points[1].name = "correction"; }, "a point clock_correction"},
      {[](Device& its) { its.points[1].type = config::Type::int16; }, "type: bool"},
      {[](Device& its) { its.points[1].writing.allowed = false; }, "the device's 'write'"},
      {[](Device& its) { its.points[1].writing.select = true; }, "no 'select'"},
  };
  for (const Row& row : rows) {
    Device wrong = right;
    row.spoil(wrong);
    const Status status = Set4tmProtocol().check_device(wrong);
    ASSERT_FALSE(status) << row.says;
    EXPECT_NE(status.error().find(row.says), std::string::npos) << status.error();
  }
  right.options.Set("correct_clock", std::int64_t{0});
  EXPECT_FALSE(ClockCareOf(right));
}

class ClockLine : public ::testing::Test {
 protected:
  ClockLine() { Make(); }
  void Make() {
    config::Device device = MakeDevice("5", {MakePoint("04 00 drift@0")});
    device.name = "m1";
    device.protocol = "set4tm";
    device.poll = 1s;
    device.options.Set("time_zone", std::string("+03:00"));
    config::Point correction;
    correction.name = "correction";
    correction.write = "03 0B";
    correction.access = config::Access::write;
    correction.type = config::Type::boolean;
    device.points.push_back(correction);
    config::Line its;
    its.name = "meters";
    its.protocol = "set4tm";
    its.serial = {.baud = 9600, .data_bits = 8, .parity = config::Parity::odd};
    its.devices = {device};
    line = std::make_unique<VirtualLine>(std::move(its), std::vector{&Set4tmProtocol()});
  }
  void MeterIsAhead(Duration by) {
    line->twin(0).twin->SetClock({line->now().instant, line->now().wall + by});
  }
  std::size_t Corrections() const {
    return static_cast<std::size_t>(std::ranges::count_if(line->sent, [](const Sent& sent) {
      return sent.text.size() > 2 && sent.text[1] == 0x03 && sent.text[2] == 0x0B;
    }));
  }

  std::unique_ptr<VirtualLine> line;
};

TEST_F(ClockLine, TheDriftIsGoodWhileTheHostClockIsGood) {
  MeterIsAhead(-42s);
  line->Open();
  line->RunFor(5s);
  EXPECT_TRUE(IsUncertain(line->QualityOf(0, 0)));
  line->poller().OnHostClock(true);
  line->RunFor(5s);
  EXPECT_TRUE(IsGood(line->QualityOf(0, 0)));
  EXPECT_NEAR(ToDouble(line->ValueOf(0, 0)), -42, 0.6);
  line->poller().OnHostClock(false);
  line->RunFor(5s);
  EXPECT_TRUE(IsUncertain(line->QualityOf(0, 0)));
}

TEST_F(ClockLine, TheMeterClockIsCorrectedOnceADay) {
  MeterIsAhead(30s);
  line->Open();
  line->RunFor(5s);
  ASSERT_TRUE(line->Write(0, 1, Value(true)));
  line->RunFor(5s);
  EXPECT_EQ(Corrections(), 0U) << "this machine's clock is not known to be right";
  line->poller().OnHostClock(true);
  line->RunFor(5s);
  ASSERT_TRUE(line->Write(0, 1, Value(true)));
  line->RunFor(5s);
  EXPECT_EQ(Corrections(), 1U);
  EXPECT_NEAR(ToDouble(line->ValueOf(0, 0)), 0, 1.1);
  MeterIsAhead(60s);
  line->RunFor(5s);
  ASSERT_EQ(line->ends.size(), 2U);
  EXPECT_NE(line->ends[0], line->ends[1]);
}

class Reluctant : public Twin {
 public:
  Reluctant(std::unique_ptr<Twin> twin, std::uint8_t status)
      : twin_(std::move(twin)), status_(status) {}
  Bytes Answer(View request, Instant now) override {
    const auto parts = SplitFrame(request);
    if (said_ || !parts || parts->body[0] != kWrite) return twin_->Answer(request, now);
    said_ = true;
    return MakeFrame(parts->address, Bytes{status_});
  }
  void ReplyAs(std::string_view address) override { twin_->ReplyAs(address); }

 private:
  std::unique_ptr<Twin> twin_;
  const std::uint8_t status_;
  bool said_ = false;
};

/// The meter refuses the write with status 05 (the channel was closed meanwhile) or 06 (repeat the
/// request), and does not execute it.
TEST_F(ClockLine, ACorrectionIsRepeatedOnRequestOfTheMeter) {
  for (const int status : {5, 6}) {
    Make();
    MeterIsAhead(30s);
    line->twin(0).twin = std::make_unique<Reluctant>(std::move(line->twin(0).twin),
                                                     static_cast<std::uint8_t>(status));
    line->Open();
    line->poller().OnHostClock(true);
    line->RunFor(5s);
    ASSERT_TRUE(line->Write(0, 1, Value(true)));
    line->RunFor(5s);
    EXPECT_EQ(Corrections(), 2U) << status;
    ASSERT_EQ(line->ends.size(), 1U);
    EXPECT_EQ(line->ends[0], WriteEnd::ok) << status;
  }
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
