// Tests of the encoding of DDS samples. The expected bytes were computed by another program.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {
namespace {

constexpr char kPointLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 09 00 00 00 66 65 65 64 "
    "65 72 2D 31 00 00 00 00 0B 00 00 00 63 75 72 72 65 6E 74 5F 6C 31 00 00 "
    "00 00 00 00 A4 70 3D 0A D7 A3 E0 3F 01 00 00 00 00 00 00 00 04 00 00 00 "
    "78 49 6E 00 C0 00 00 00 00 00 00 00 80 D6 9D F9 82 EB E9 18 07 00 00 00 "
    "00 00 00 00 39 30 00 00 ";
constexpr char kPointBe[] =
    "00 00 00 00 00 00 00 06 73 75 62 2D 37 00 00 00 00 00 00 09 66 65 65 64 "
    "65 72 2D 31 00 00 00 00 00 00 00 0B 63 75 72 72 65 6E 74 5F 6C 31 00 00 "
    "00 00 00 00 3F E0 A3 D7 0A 3D 70 A4 00 00 00 01 00 00 00 00 00 00 00 04 "
    "78 49 6E 00 00 C0 00 00 00 00 00 00 18 E9 EB 82 F9 9D D6 80 00 00 00 00 "
    "00 00 00 07 00 00 30 39 ";
constexpr char kDeviceLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 09 00 00 00 66 65 65 64 "
    "65 72 2D 31 00 00 00 00 06 00 00 00 62 61 79 2D 31 00 01 00 02 00 00 00 "
    "00 00 00 00 80 D6 9D F9 82 EB E9 18 64 00 00 00 5F 00 00 00 03 00 00 00 "
    "02 00 00 00 04 00 00 00 39 30 00 00 A0 5B 00 00 ";
constexpr char kGatewayLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 00 00 00 00 80 D6 9D F9 82 EB E9 18 "
    "06 00 00 00 31 2E 32 2E 33 00";

constexpr char kEventLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 09 00 00 00 66 65 65 64 "
    "65 72 2D 31 00 00 00 00 00 00 00 00 67 12 00 00 00 00 00 00 80 D6 9D F9 "
    "82 EB E9 18 00 C7 98 FC 82 EB E9 18 02 00 03 00 70 11 01 00 11 00 00 00 "
    "73 74 61 67 65 20 49 3E 20 73 74 61 72 74 65 64 00";
constexpr char kEventBe[] =
    "00 00 00 00 00 00 00 06 73 75 62 2D 37 00 00 00 00 00 00 09 66 65 65 64 "
    "65 72 2D 31 00 00 00 00 00 00 00 00 00 00 00 00 00 00 12 67 18 E9 EB 82 "
    "F9 9D D6 80 18 E9 EB 82 FC 98 C7 00 00 02 00 03 00 01 11 70 00 00 00 11 "
    "73 74 61 67 65 20 49 3E 20 73 74 61 72 74 65 64 00";
constexpr char kRequestLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 06 00 00 00 70 6C 63 2D "
    "31 00 00 00 2A 00 00 00 00 00 00 00 09 00 00 00 66 65 65 64 65 72 2D 31 "
    "00 00 00 00 0E 00 00 00 73 65 74 74 69 6E 67 5F 67 72 6F 75 70 00 00 00 "
    "00 00 00 00 00 00 00 00 00 00 F0 3F 02 00 00 00 32 00 01 00 C4 09 00 00 "
    "00 00 00 00 80 D6 9D F9 82 EB E9 18";
constexpr char kRequestBe[] =
    "00 00 00 00 00 00 00 06 73 75 62 2D 37 00 00 00 00 00 00 06 70 6C 63 2D "
    "31 00 00 00 00 00 00 00 00 00 00 2A 00 00 00 09 66 65 65 64 65 72 2D 31 "
    "00 00 00 00 00 00 00 0E 73 65 74 74 69 6E 67 5F 67 72 6F 75 70 00 00 00 "
    "00 00 00 00 3F F0 00 00 00 00 00 00 00 00 00 02 32 00 01 00 00 00 09 C4 "
    "00 00 00 00 18 E9 EB 82 F9 9D D6 80";
constexpr char kReplyLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 06 00 00 00 70 6C 63 2D "
    "31 00 00 00 2A 00 00 00 00 00 00 00 09 00 00 00 6E 6F 74 5F 73 65 6E 74 "
    "00 00 00 00 05 00 00 00 6C 61 74 65 00 00 00 00 39 30 00 00";

PointSample APoint() {
  return {.gateway = "sub-7",
          .device = "feeder-1",
          .point = "current_l1",
          .value = 0.52,
          .text = "",
          .unit = "xIn",
          .quality = 0xC0,
          .source_time_ns = 1795224874250000000,
          .seq = 7,
          .rtt_us = 12345};
}

DeviceSample ADevice() {
  return {.gateway = "sub-7",
          .device = "feeder-1",
          .line = "bay-1",
          .state = 1,
          .last_outcome = 2,
          .last_ok_time_ns = 1795224874250000000,
          .exchanges = 100,
          .ok = 95,
          .no_reply = 3,
          .corrupt = 2,
          .retries = 4,
          .rtt_mean_us = 12345,
          .rtt_p99_us = 23456};
}

GatewaySample AGateway() {
  return {.gateway = "sub-7", .start_time_ns = 1795224874250000000, .version = "1.2.3"};
}

EventSample AnEvent() {
  return {.gateway = "sub-7",
          .device = "feeder-1",
          .seq = 4711,
          .device_time_ns = 1795224874250000000,
          .receive_time_ns = 1795224874300000000,
          .clock_quality = 2,
          .channel = 3,
          .code = 70000,
          .text = "stage I> started"};
}

constexpr char kAlarmLe[] =
    "00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 06 00 00 00 62 61 79 2D 31 00 00 00 09 00 "
    "00 00 66 65 65 64 65 72 2D 31 00 00 00 00 13 00 00 00 63 75 72 72 65 6E 74 5F 6C 31 20 61 "
    "62 6F 76 65 20 35 00 00 0B 00 00 00 63 75 72 72 65 6E 74 5F 6C 31 00 00 03 00 02 00 00 00 "
    "00 00 9C 01 00 00 00 00 00 00 80 D6 9D F9 82 EB E9 18 00 C7 98 FC 82 EB E9 18 1E 00 00 00 "
    "63 75 72 72 65 6E 74 5F 6C 31 20 35 2E 33 20 41 3A 20 6F 76 65 72 63 75 72 72 65 6E 74 00 "
    "00 00 0A 00 00 00 75 73 65 72 3A 61 6E 6E 61 00";
constexpr char kAlarmBe[] =
    "00 00 00 00 00 00 00 06 73 75 62 2D 37 00 00 00 00 00 00 06 62 61 79 2D 31 00 00 00 00 00 "
    "00 09 66 65 65 64 65 72 2D 31 00 00 00 00 00 00 00 13 63 75 72 72 65 6E 74 5F 6C 31 20 61 "
    "62 6F 76 65 20 35 00 00 00 00 00 0B 63 75 72 72 65 6E 74 5F 6C 31 00 00 00 03 00 02 00 00 "
    "00 00 00 00 00 00 00 00 01 9C 18 E9 EB 82 F9 9D D6 80 18 E9 EB 82 FC 98 C7 00 00 00 00 1E "
    "63 75 72 72 65 6E 74 5F 6C 31 20 35 2E 33 20 41 3A 20 6F 76 65 72 63 75 72 72 65 6E 74 00 "
    "00 00 00 00 00 0A 75 73 65 72 3A 61 6E 6E 61 00";

AlarmSample AnAlarm() {
  return {.gateway = "sub-7",
          .line = "bay-1",
          .device = "feeder-1",
          .name = "current_l1 above 5",
          .point = "current_l1",
          .state = 3,
          .priority = 2,
          .seq = 412,
          .raised_time_ns = 1795224874250000000,
          .changed_time_ns = 1795224874300000000,
          .text = "current_l1 5.3 A: overcurrent",
          .acknowledged_by = "user:anna"};
}

RequestSample ARequest() {
  return {.gateway = "sub-7",
          .client = "plc-1",
          .seq = 42,
          .device = "feeder-1",
          .point = "setting_group",
          .value = 1,
          .text = "2",
          .confirm = true,
          .deadline_ms = 2500,
          .not_after_ns = 1795224874250000000};
}

ReplySample AReply() { return {"sub-7", "plc-1", 42, "not_sent", "late", 12345}; }

template <typename Sample>
Bytes Encoded(const Sample& sample) {
  Bytes bytes(512);
  bytes.resize(Encode(sample, bytes));
  return bytes;
}

/// Copies the bytes to memory of exact size, so that a sanitizer finds a read beyond the end.
bool DecodesAsPoint(const Bytes& bytes) {
  PointSample sample;
  return Decode(Bytes(bytes), sample);
}

TEST(Cdr, EncodesTheBytesOfTheContract) {
  EXPECT_EQ(ToHex(Encoded(APoint())), Trim(kPointLe));
  EXPECT_EQ(ToHex(Encoded(ADevice())), Trim(kDeviceLe));
  EXPECT_EQ(ToHex(Encoded(AGateway())), kGatewayLe);
}

TEST(Cdr, DecodesBothByteOrders) {
  for (const char* hex : {kPointLe, kPointBe}) {
    PointSample sample;
    ASSERT_TRUE(Decode(*ParseHex(Trim(hex)), sample)) << hex;
    EXPECT_EQ(sample, APoint());
  }
  DeviceSample status;
  ASSERT_TRUE(Decode(*ParseHex(Trim(kDeviceLe)), status));
  EXPECT_EQ(status, ADevice());
  GatewaySample gateway;
  ASSERT_TRUE(Decode(*ParseHex(kGatewayLe), gateway));
  EXPECT_EQ(gateway, AGateway());
}

TEST(Cdr, EncodesRequestsAndRepliesOfTheContract) {
  EXPECT_EQ(ToHex(Encoded(ARequest())), kRequestLe);
  EXPECT_EQ(ToHex(Encoded(AReply())), kReplyLe);
  for (const char* hex : {kRequestLe, kRequestBe}) {
    RequestSample request;
    ASSERT_TRUE(Decode(*ParseHex(hex), request)) << hex;
    EXPECT_EQ(request, ARequest());
  }
  ReplySample reply;
  ASSERT_TRUE(Decode(*ParseHex(kReplyLe), reply));
  EXPECT_EQ(reply, AReply());
}

TEST(Cdr, EncodesEventsOfTheContract) {
  EXPECT_EQ(ToHex(Encoded(AnEvent())), kEventLe);
  EventSample event;
  for (const char* hex : {kEventLe, kEventBe}) {
    ASSERT_TRUE(Decode(*ParseHex(hex), event)) << hex;
    EXPECT_EQ(event, AnEvent());
  }
  const Bytes bytes = *ParseHex(kEventLe);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(Decode(Bytes(bytes.begin(), bytes.begin() + static_cast<long>(length)), event));
  }
  std::mt19937 random(7);
  for (int round = 0; round < 50'000; ++round) {
    Bytes bent = bytes;
    bent[random() % bent.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    if (Decode(bent, event)) {
      EXPECT_LE(event.device.size(), kMaxKey);
      EXPECT_LE(event.text.size(), kMaxText);
    }
  }
  EventSample full = AnEvent();
  full.gateway = full.device = std::string(kMaxKey, 'k');
  full.text = std::string(kMaxText, 't');
  EXPECT_EQ(Encoded(full).size(), kMaxBytes<EventSample>);
  full.text += 't';
  EXPECT_TRUE(Encoded(full).empty());
}

TEST(Cdr, EncodesAlarmsOfTheContract) {
  EXPECT_EQ(ToHex(Encoded(AnAlarm())), kAlarmLe);
  AlarmSample alarm;
  for (const char* hex : {kAlarmLe, kAlarmBe}) {
    ASSERT_TRUE(Decode(*ParseHex(hex), alarm)) << hex;
    EXPECT_EQ(alarm, AnAlarm());
  }
  const Bytes bytes = *ParseHex(kAlarmLe);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(Decode(Bytes(bytes.begin(), bytes.begin() + static_cast<long>(length)), alarm));
  }
  AlarmSample full = AnAlarm();
  full.gateway = full.line = full.device = full.point = full.acknowledged_by =
      std::string(kMaxKey, 'k');
  full.name = std::string(kMaxAlarmName, 'n');
  full.text = std::string(kMaxText, 't');
  Bytes room(1024);
  EXPECT_EQ(Encode(full, room), kMaxBytes<AlarmSample>);
  full.name += 'n';
  EXPECT_EQ(Encode(full, room), 0U);
}

TEST(Cdr, RefusesDamagedRequestsAndReplies) {
  const Bytes request = Encoded(ARequest());
  for (std::size_t length = 0; length < request.size(); ++length) {
    RequestSample read;
    EXPECT_FALSE(Decode(Bytes(request.begin(), request.begin() + static_cast<long>(length)), read));
  }
  const Bytes reply = Encoded(AReply());
  for (std::size_t length = 0; length < reply.size(); ++length) {
    ReplySample read;
    EXPECT_FALSE(Decode(Bytes(reply.begin(), reply.begin() + static_cast<long>(length)), read));
  }
  Bytes maybe = request;
  maybe[90] = 2;
  RequestSample read;
  ASSERT_EQ(request[90], 1);
  EXPECT_FALSE(Decode(maybe, read)) << "neither true nor false";
  std::mt19937 random(7);
  for (int round = 0; round < 50'000; ++round) {
    Bytes bent = request;
    bent[random() % bent.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    if (Decode(bent, read)) {
      EXPECT_LE(read.client.size(), kMaxKey);
      EXPECT_LE(read.text.size(), kMaxText);
    }
  }
}

TEST(Cdr, RoundTripsNaNAndLimits) {
  PointSample sample = APoint();
  sample.value = std::numeric_limits<double>::quiet_NaN();
  sample.seq = std::numeric_limits<std::uint64_t>::max();
  sample.source_time_ns = std::numeric_limits<std::int64_t>::min();
  PointSample back;
  ASSERT_TRUE(Decode(Encoded(sample), back));
  EXPECT_TRUE(std::isnan(back.value));
  EXPECT_EQ(back.seq, sample.seq);
  EXPECT_EQ(back.source_time_ns, sample.source_time_ns);
}

TEST(Cdr, FullTextsFitTheDeclaredSize) {
  for (std::size_t shorter = 0; shorter < 8; ++shorter) {
    PointSample sample = APoint();
    sample.gateway = sample.device = std::string(kMaxKey, 'k');
    sample.point = std::string(kMaxKey - shorter, 'k');
    sample.text = std::string(kMaxText - shorter / 2, 't');
    sample.unit = std::string(kMaxUnit, 'u');
    const Bytes bytes = Encoded(sample);
    ASSERT_FALSE(bytes.empty());
    EXPECT_LE(bytes.size(), kMaxBytes<PointSample>);
    PointSample back;
    ASSERT_TRUE(Decode(bytes, back));
    EXPECT_EQ(back, sample);
  }
  DeviceSample status = ADevice();
  status.gateway = status.device = status.line = std::string(kMaxKey, 'k');
  const Bytes bytes = Encoded(status);
  ASSERT_FALSE(bytes.empty());
  EXPECT_LE(bytes.size(), kMaxBytes<DeviceSample>);
  const GatewaySample gateway{std::string(kMaxKey, 'k'), 1, std::string(kMaxVersion, 'v')};
  const Bytes gateway_bytes = Encoded(gateway);
  ASSERT_FALSE(gateway_bytes.empty());
  EXPECT_LE(gateway_bytes.size(), kMaxBytes<GatewaySample>);
}

TEST(Cdr, FullRequestsAndRepliesFitTheDeclaredSize) {
  RequestSample request = ARequest();
  request.gateway = request.client = request.device = request.point = std::string(kMaxKey, 'k');
  request.text = std::string(kMaxText, 't');
  EXPECT_EQ(Encoded(request).size(), kMaxBytes<RequestSample>);
  ReplySample reply = AReply();
  reply.gateway = reply.client = std::string(kMaxKey, 'k');
  reply.outcome = std::string(kMaxOutcome, 'o');
  reply.reason = std::string(kMaxReason, 'r');
  EXPECT_EQ(Encoded(reply).size(), kMaxBytes<ReplySample>);
  reply.reason += 'r';
  EXPECT_TRUE(Encoded(reply).empty());
  request.client += 'k';
  EXPECT_TRUE(Encoded(request).empty());
}

TEST(Cdr, RefusesToEncodeTextsBeyondTheirBounds) {
  PointSample sample = APoint();
  sample.text = std::string(kMaxText + 1, 't');
  EXPECT_TRUE(Encoded(sample).empty());
  sample = APoint();
  sample.device = std::string(kMaxKey + 1, 'k');
  EXPECT_TRUE(Encoded(sample).empty());
  sample = APoint();
  sample.unit = std::string("A\0B", 3);
  EXPECT_TRUE(Encoded(sample).empty());
  GatewaySample gateway = AGateway();
  gateway.version = std::string(kMaxVersion + 1, 'v');
  EXPECT_TRUE(Encoded(gateway).empty());
  Bytes small(Encoded(APoint()).size() - 1);
  EXPECT_EQ(Encode(APoint(), small), 0U);
}

TEST(Cdr, RefusesEveryTruncation) {
  const Bytes point = Encoded(APoint());
  for (std::size_t length = 0; length < point.size(); ++length) {
    EXPECT_FALSE(DecodesAsPoint(Bytes(point.begin(), point.begin() + static_cast<long>(length))))
        << length;
  }
  const Bytes device = Encoded(ADevice());
  for (std::size_t length = 0; length < device.size(); ++length) {
    DeviceSample status;
    EXPECT_FALSE(Decode(Bytes(device.begin(), device.begin() + static_cast<long>(length)), status));
  }
  const Bytes gateway = Encoded(AGateway());
  for (std::size_t length = 0; length < gateway.size(); ++length) {
    GatewaySample read;
    EXPECT_FALSE(Decode(Bytes(gateway.begin(), gateway.begin() + static_cast<long>(length)), read));
  }
}

TEST(Cdr, RefusesOtherEncapsulations) {
  Bytes bytes = Encoded(APoint());
  for (int id = 2; id <= 0xFFFF; ++id) {
    bytes[0] = static_cast<std::uint8_t>(id >> 8);
    bytes[1] = static_cast<std::uint8_t>(id & 0xFF);
    ASSERT_FALSE(DecodesAsPoint(bytes)) << id;
  }
}

TEST(Cdr, RefusesToDecodeTextsBeyondTheirBound) {
  Bytes bytes = *ParseHex("00 01 00 00 42 00 00 00");
  Append(bytes, std::string(65, 'k') + '\0');
  bytes.resize(bytes.size() + 2);
  const Bytes good = Encoded(APoint());
  Append(bytes, View(good).subspan(4 + 12));
  EXPECT_FALSE(DecodesAsPoint(bytes));
}

TEST(Cdr, RefusesLengthsBeyondTheSample) {
  for (const char* length : {"FF FF FF FF", "FF FF FF 7F", "00 00 00 80", "00 01 00 00"}) {
    Bytes bytes = Encoded(APoint());
    const Bytes patch = *ParseHex(length);
    std::copy(patch.begin(), patch.end(), bytes.begin() + 4);
    EXPECT_FALSE(DecodesAsPoint(bytes)) << length;
  }
}

TEST(Cdr, SurvivesRandomBytes) {
  std::mt19937 random(7);
  const Bytes good = Encoded(APoint());
  for (int round = 0; round < 50'000; ++round) {
    Bytes noise(random() % 200);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    if (noise.size() > 4 && round % 2 == 0) noise[0] = 0, noise[1] = 1;
    EXPECT_FALSE(DecodesAsPoint(noise));
    Bytes bent = good;
    bent[random() % bent.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    PointSample sample;
    if (Decode(bent, sample)) {
      EXPECT_LE(sample.device.size(), kMaxKey);
      EXPECT_LE(sample.text.size(), kMaxText);
    }
  }
}

TEST(AssignBounded, MarksATruncatedTextWithAnEllipsis) {
  std::string text;
  AssignBounded(text, "short", 16);
  EXPECT_EQ(text, "short");
  AssignBounded(text, "0123456789abcdef", 16);
  EXPECT_EQ(text, "0123456789abcdef");
  AssignBounded(text, "0123456789abcdefg", 16);
  EXPECT_EQ(text, "0123456789abc\u2026");
  EXPECT_EQ(text.size(), 16U);
}

TEST(AssignBounded, ReplacesInvalidUtf8) {
  std::string text;
  for (const auto& [from, to] :
       {std::pair("caf\xE9 \xC3\xA9", "caf\uFFFD \u00E9"), std::pair("\xFF\xFE", "\uFFFD\uFFFD"),
        std::pair("\xC3", "\uFFFD"),
        std::pair("\xE9\xE9\xE9\xE9\xE9\xE9", "\uFFFD\uFFFD\uFFFD\uFFFD\u2026")}) {
    AssignBounded(text, from, 16);
    EXPECT_EQ(text, to);
  }
}

TEST(AssignBounded, NeverCutsInsideACharacter) {
  std::string text;
  AssignBounded(text, "0123456789ab\u00B0\u00B0\u00B0", 16);
  EXPECT_EQ(text, "0123456789ab\u2026");
}

TEST(AssignBounded, EndsAtANul) {
  std::string text;
  AssignBounded(text, std::string_view("SPCJ\0\0\0", 7), 16);
  EXPECT_EQ(text, "SPCJ");
}

using Types = std::map<std::string, std::vector<std::string>>;

std::string Read(const std::string& name) {
  std::ifstream file("gateway/outputs/dds/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::smatch> Matches(const std::string& text, const std::string& pattern) {
  static std::map<std::string, std::regex> made;
  const std::regex& regex = made.try_emplace(pattern, pattern).first->second;
  return {std::sregex_iterator(text.begin(), text.end(), regex), std::sregex_iterator()};
}

Types OfIdl() {
  const std::string text = Read("baudgate.idl");
  Types types;
  for (const auto& found : Matches(text, R"(struct (\w+) \{([^}]*)\})")) {
    const std::string body = found[2];
    for (const auto& field : Matches(body, R"(\s*([^;]+?)\s+(\w+);)")) {
      types[found[1]].push_back(field[1].str() + " " + field[2].str());
    }
  }
  return types;
}

Types OfXml() {
  const std::map<std::string, std::string> idl = {
      {"boolean", "boolean"},      {"float64", "double"},  {"uint16", "unsigned short"},
      {"uint32", "unsigned long"}, {"int64", "long long"}, {"uint64", "unsigned long long"}};
  const std::string text = TypesXml();
  Types types;
  for (const auto& found :
       Matches(text, R"re(<struct name="(\w+)" extensibility="final">([\s\S]*?)</struct>)re")) {
    const std::string body = found[2];
    for (
        const auto& field : Matches(
            body,
            R"re(<member name="(\w+)" type="(\w+)"(?: stringMaxLength="(\d+)")?( key="true")?/>)re")) {
      const std::string type =
          field[2] == "string" ? "string<" + field[3].str() + ">" : idl.at(field[2]);
      types[found[1]].push_back((field[4].matched ? "@key " : "") + type + " " + field[1].str());
    }
  }
  return types;
}

std::string TypeName(const TypeField& field) {
  switch (field.kind) {
    case TypeField::Kind::text:
      return "string<" + std::to_string(field.bound) + ">";
    case TypeField::Kind::boolean:
      return "boolean";
    case TypeField::Kind::float64:
      return "double";
    case TypeField::Kind::uint16:
      return "unsigned short";
    case TypeField::Kind::uint32:
      return "unsigned long";
    case TypeField::Kind::int64:
      return "long long";
    case TypeField::Kind::uint64:
      return "unsigned long long";
  }
  return "?";
}

std::vector<std::string> Announced(const TypeDescription& type) {
  std::vector<std::string> fields;
  for (const TypeField& field : type.fields) {
    fields.push_back((field.key ? "@key " : "") + TypeName(field) + " " + std::string(field.name));
  }
  return fields;
}

TEST(TypeFields, MatchTheIdl) {
  Types types;
  ForEachType(
      [&types](const TypeDescription& type) { types[std::string(type.name)] = Announced(type); });
  EXPECT_EQ(types, OfIdl());
}

TEST(TypeFields, OfTheXmlMatchTheIdl) { EXPECT_EQ(OfXml(), OfIdl()); }

}  // namespace
}  // namespace baudgate::dds
