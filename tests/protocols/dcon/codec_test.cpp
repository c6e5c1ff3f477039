// Tests DCON frames: worked examples of the reference, checksums, addresses.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/codec.h"

#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/dcon/decode.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

struct Vector {
  std::string_view body;
  std::string_view frame;
};

constexpr Vector kRequests[] = {
    {"#01", "#0184\r"},     {"#4A", "#4A98\r"},
    {"$012", "$012B7\r"},   {"#017", "#017BB\r"},
    {"$0A6", "$0A6CB\r"},   {"#0A1301", "#0A130159\r"},
    {"@0A3C", "@0A3C27\r"}, {"#0B2+07.500", "#0B2+07.5001C\r"},
    {"$0BM", "$0BME3\r"},   {"~**", "~**D2\r"},
    {"#**", "#**77\r"},     {"%0B0C400640", "%0B0C40064038\r"},
};

constexpr Vector kReplies[] = {
    {">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880",
     ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880FC\r"},
    {">+1.2-33.44+555.666", ">+1.2-33.44+555.666BD\r"},
    {">+100.23+34.050", ">+100.23+34.050E2\r"},
    {"!01200600", "!01200600AA\r"},
    {">-02.471", ">-02.47197\r"},
    {">7FFF8000000040000000000000000000", ">7FFF800000004000000000000000000093\r"},
    {">+9999.9-9999.9", ">+9999.9-9999.92C\r"},
    {"!2A1500", "!2A15005A\r"},
    {">", ">3E\r"},
    {"!", "!21\r"},
    {"?", "?3F\r"},
    {"?01", "?01A0\r"},
    {"?0A", "?0AB0\r"},
    {"!0B+07.500", "!0B+07.500E8\r"},
    {"!0B7060", "!0B706060\r"},
    {">0C1+012.50", ">0C1+012.5033\r"},
    {"!0B00042", "!0B0004289\r"},
    {">0001E240", ">0001E240DA\r"},
    {"!0C", "!0C94\r"},
};

TEST(DconCodec, RequestsMatchTheWorkedExamples) {
  for (const Vector& vector : kRequests) {
    SCOPED_TRACE(vector.frame);
    const auto parsed = ParseRequest(ToBytes(vector.frame), true);
    ASSERT_TRUE(parsed.has_value());
    EXPECT_EQ(parsed->text.front(), vector.body.front());
    EXPECT_EQ(parsed->text.substr(1), vector.body.substr(3));
    if (vector.body.substr(1, 2) == "**") {
      EXPECT_TRUE(parsed->broadcast);
      continue;
    }
    EXPECT_EQ(HexByte(parsed->address), vector.body.substr(1, 2));
    EXPECT_EQ(AsText(BuildRequest(parsed->text, parsed->address, true)), vector.frame);
    EXPECT_EQ(AsText(BuildRequest(parsed->text, parsed->address, false)),
              std::string(vector.body) + "\r");
  }
}

TEST(DconCodec, TheSampleBroadcastNeedsNoLineEnd) {
  const auto bare = ParseRequest(ToBytes("#**"), false);
  EXPECT_TRUE(bare && bare->broadcast);
  const auto summed = ParseRequest(ToBytes("#**77"), true);
  EXPECT_TRUE(summed && summed->broadcast);
  EXPECT_FALSE(ParseRequest(ToBytes("#**"), true));
  EXPECT_FALSE(ParseRequest(ToBytes("#01"), false));
}

TEST(DconCodec, RepliesMatchTheWorkedExamples) {
  for (const Vector& vector : kReplies) {
    SCOPED_TRACE(vector.frame);
    EXPECT_EQ(AsText(BuildReply(vector.body, true)), vector.frame);
    const auto parsed = ParseReply(ToBytes(vector.frame), kChecksum);
    ASSERT_TRUE(parsed.has_value());
    EXPECT_EQ(parsed->lead, vector.body.front());
    EXPECT_EQ(parsed->body, vector.body.substr(1));
    const auto bare = ParseReply(ToBytes(std::string(vector.body) + "\r"), kNoChecksum);
    ASSERT_TRUE(bare.has_value());
    EXPECT_EQ(bare->body, vector.body.substr(1));
  }
}

TEST(DconCodec, EveryDamagedCharacterIsNoticed) {
  for (const Vector& vector : kReplies) {
    for (std::size_t i = 0; i < vector.frame.size(); ++i) {
      Bytes damaged = ToBytes(vector.frame);
      damaged[i] = static_cast<std::uint8_t>(damaged[i] + 1);
      EXPECT_FALSE(ParseReply(damaged, kChecksum).has_value()) << Printable(damaged);
    }
  }
}

TEST(DconCodec, AChecksumMayHaveEitherCase) {
  EXPECT_TRUE(ParseReply(ToBytes(">+1.2-33.44+555.666bd\r"), kChecksum).has_value());
  EXPECT_TRUE(ParseRequest(ToBytes("$0A6cb\r"), true).has_value());
}

TEST(DconCodec, ACounterReplyMayHaveItsChecksumInFront) {
  const Bytes frame = ToBytes(">D40000001E\r");
  EXPECT_EQ(BuildCounterReplyFront("0000001E"), frame);
  for (const int variant : {kChecksumEither, kChecksumFront}) {
    const auto reply = ParseReply(frame, variant);
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->body, "0000001E");
    EXPECT_FALSE(reply->ambiguous);
  }
  EXPECT_FALSE(ParseReply(frame, kChecksum).has_value());
  const Bytes behind = ToBytes(">0001E240DA\r");
  EXPECT_EQ(ParseReply(behind, kChecksumEither)->body, "0001E240");
  EXPECT_FALSE(ParseReply(behind, kChecksumFront).has_value());
  EXPECT_TRUE(ParseReply(ToBytes("?0AB0\r"), kChecksumFront).has_value());
}

/// Some counts fit with and without a checksum, so they must be marked as ambiguous.
TEST(DconCodec, ACounterChecksumThatFitsBothWaysIsAmbiguous) {
  int ambiguous = 0;
  for (unsigned count = 0; count < 0x10000; ++count) {
    const std::string data = "0000" + HexByte(static_cast<std::uint8_t>(count >> 8U)) +
                             HexByte(static_cast<std::uint8_t>(count));
    const auto reply = ParseReply(BuildCounterReplyFront(data), kChecksumEither);
    ASSERT_TRUE(reply.has_value());
    if (reply->ambiguous) {
      ++ambiguous;
    } else {
      ASSERT_EQ(reply->body, data);
    }
    ASSERT_EQ(ParseReply(BuildCounterReplyFront(data), kChecksumFront)->body, data);
  }
  EXPECT_GT(ambiguous, 0);
}

TEST(DconCodec, InvalidRequestsAreRefused) {
  EXPECT_FALSE(ParseRequest(ToBytes("#0184"), true));
  EXPECT_FALSE(ParseRequest(ToBytes("#0185\r"), true));
  EXPECT_FALSE(ParseRequest(ToBytes("#01\r"), true));
  EXPECT_FALSE(ParseRequest(ToBytes("#0G\r"), false));
  EXPECT_FALSE(ParseRequest(ToBytes("#0\r"), false));
  EXPECT_FALSE(ParseRequest(ToBytes(">01\r"), false));
  EXPECT_FALSE(ParseRequest(ToBytes("#01\n\r"), false));
  EXPECT_FALSE(ParseRequest(Bytes{}, false));
}

TEST(DconCodec, AddressesAreParsed) {
  EXPECT_EQ(ParseAddress("0").value(), 0);
  EXPECT_EQ(ParseAddress("74").value(), 0x4A);
  EXPECT_EQ(ParseAddress("0x4A").value(), 0x4A);
  EXPECT_EQ(ParseAddress("255").value(), 255);
  for (const std::string_view bad : {"", "256", "-1", "4A", "0x", "0x100", "1 ", "*"}) {
    const auto parsed = ParseAddress(bad);
    ASSERT_FALSE(parsed) << bad;
    EXPECT_NE(parsed.error().find("0...255"), std::string::npos);
  }
  EXPECT_EQ(AsText(BuildRequest("#", ParseAddress("74").value(), true)), "#4A98\r");
}

TEST(DconCodec, ChecksumIsTheSumOfAllCharacters) {
  EXPECT_EQ(Sum8(ToBytes("#01")), 0x84);
  EXPECT_TRUE(ChecksumFits("#0184", kChecksum));
  EXPECT_FALSE(ChecksumFits("84", kChecksum));
  EXPECT_FALSE(ChecksumFits("", kChecksum));
}

/// Decodes the reply to `command` to address 01. `reply` is the text between lead and CR.
DecodedReply Decode(std::string_view command, std::string_view reply, std::size_t channels = 0,
                    const Settable& options = {}, std::optional<Form> form = std::nullopt,
                    std::uint8_t address = 1) {
  Settings settings = ReadSettings(MakeOptions(options));
  Command request;
  request.address = address;
  request.text = command;
  return DecodeReply(request, form, channels, BuildReply(reply, settings.checksum), settings);
}

std::vector<double> Numbers(const DecodedReply& decoded) {
  std::vector<double> numbers;
  for (const Field& field : decoded.fields) numbers.push_back(ToDouble(field.value));
  return numbers;
}

TEST(DconFaults, NinesWithAPointAreAFaultIfConfigured) {
  Settings owen;
  owen.nines = true;
  const Settings others;
  const auto quality = [](const std::string& token, const Settings& settings) {
    const Fields cut = CutFields(token, settings, false);
    return cut.outcome == Outcome::ok && cut.fields.size() == 1 ? cut.fields[0].quality
                                                                : Quality(Quality::bad);
  };
  for (std::string token :
       {"+99999.", "+9999.9", "+999.99", "+99.999", "+9.9999", "+.99999", "+999999", "+99999"}) {
    EXPECT_EQ(quality(token, owen), Quality(Quality::bad_sensor_failure, Reason::over_range))
        << token;
    token[0] = '-';
    EXPECT_EQ(quality(token, owen), Quality(Quality::bad_sensor_failure, Reason::under_range))
        << token;
  }
  for (const std::string token : {"+99998.", "+99.990", "+89.999", "+099.99"})
    EXPECT_TRUE(IsGood(quality(token, owen))) << token;
  EXPECT_TRUE(IsGood(quality("+99.999", others)));
}

TEST(DconDecode, DecodesEightNumbers) {
  const DecodedReply decoded =
      Decode("#", ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880", 8);
  EXPECT_EQ(decoded.outcome, Outcome::ok) << decoded.reason;
  EXPECT_EQ(Numbers(decoded),
            (std::vector<double>{100.23, 34.050, 124.56, 7.331, -101.45, 1038.9, -50.501, 5.880}));
}

TEST(DconDecode, NumbersOfAnyWidthNeedTheOption) {
  EXPECT_EQ(Decode("#", ">+1.2-33.44+555.666", 3).outcome, Outcome::unexpected);
  const DecodedReply decoded = Decode("#", ">+1.2-33.44+555.666", 3, {{"width", std::int64_t{0}}});
  EXPECT_EQ(Numbers(decoded), (std::vector<double>{1.2, -33.44, 555.666}));
}

TEST(DconDecode, AnotherCountOfNumbersIsUnexpected) {
  EXPECT_EQ(Decode("#", ">+100.23+34.050", 8).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#", ">+100.23+34.050", 1).outcome, Outcome::unexpected);
  EXPECT_TRUE(Decode("#", ">+100.23+34.050", 8).fields.empty());
  EXPECT_EQ(Decode("#3", ">+100.23+34.050").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#", ">", 2).outcome, Outcome::unexpected);
}

TEST(DconDecode, AnUnexpectedChecksumGivesNoNumber) {
  const DecodedReply decoded = Decode("#0", ">-02.47197");
  EXPECT_EQ(decoded.outcome, Outcome::unexpected);
  EXPECT_NE(decoded.reason.find("checksum"), std::string::npos);
  EXPECT_TRUE(decoded.fields.empty());
  EXPECT_EQ(Decode("#", ">+100.23+34.05012", 2).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("@", ">0F0014").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$6", "!0F0000C7", 0, {}, Form::status).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$6", "!01FF00", 0, {}, Form::hex).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#0", ">0001E240DA", 0, {}, Form::counter).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#0", "!010004289", 0, {}, Form::decimal).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$A", ">7FFF800012").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$2", "!0140060012").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("~0", "!010482").outcome, Outcome::unexpected);
}

struct CodeCase {
  std::string_view token;
  Quality quality;
  std::string_view note;
};

TEST(DconDecode, CodesAreNeverNumbers) {
  constexpr CodeCase kCodes[] = {
      {"+99999", {Quality::bad_sensor_failure, Reason::over_range}, "over"},
      {"-99999", {Quality::bad_sensor_failure, Reason::under_range}, "under"},
      {"+999999", {Quality::bad_sensor_failure, Reason::over_range}, "over"},
      {"+9999", {Quality::bad_sensor_failure, Reason::over_range}, "over"},
      {"-9999", {Quality::bad_sensor_failure, Reason::under_range}, "under"},
      {"+9999.9", {Quality::bad_sensor_failure, Reason::over_range}, "over"},
      {"-9999.9", {Quality::bad_sensor_failure, Reason::under_range}, "under"},
      {"-0000", {Quality::bad_sensor_failure, Reason::under_range}, "under"},
      {"-000000", {Quality::bad_sensor_failure, Reason::under_range}, "under"},
      {"+888888", {Quality::bad_sensor_failure, Reason::open_sensor}, "open"},
      {"+123456", Quality::bad, "no decimal point"},
      {"+00000", Quality::bad, "no decimal point"},
      {"       ", {Quality::bad_out_of_service, Reason::channel_disabled}, "disabled"},
  };
  for (const CodeCase& code : kCodes) {
    SCOPED_TRACE(code.token);
    const DecodedReply decoded = Decode("#", ">+01.000" + std::string(code.token) + "-02.000", 3);
    ASSERT_EQ(decoded.outcome, Outcome::ok) << decoded.reason;
    ASSERT_EQ(decoded.fields.size(), 3U);
    EXPECT_FALSE(HasValue(decoded.fields[1].value));
    EXPECT_EQ(decoded.fields[1].quality, code.quality);
    EXPECT_NE(decoded.fields[1].note.find(code.note), std::string::npos) << decoded.fields[1].note;
    EXPECT_EQ(decoded.fields[0].value, Value{1.0});
    EXPECT_EQ(decoded.fields[2].value, Value{-2.0});
  }
}

TEST(DconDecode, NumbersSimilarToCodesAreNumbers) {
  EXPECT_EQ(Decode("#", ">+99.999+9.9999-00.000", 3).fields[0].value, Value{99.999});
  EXPECT_EQ(Decode("#", ">+99.999+9.9999-00.000", 3).fields[1].value, Value{9.9999});
  EXPECT_EQ(ToDouble(Decode("#", ">+99.999+9.9999-00.000", 3).fields[2].value), 0.0);
  EXPECT_EQ(Decode("#0", ">+999.99").fields[0].value, Value{999.99});
  const DecodedReply percent = Decode("#0", ">+999.99", 0, {{"format", std::string("percent")}});
  EXPECT_EQ(percent.fields[0].quality, Quality::bad_sensor_failure);
}

TEST(DconDecode, InvalidNumbersAreRefused) {
  for (const std::string_view bad : {">05.8800", "> +05.880", ">+0A.000", ">+1..000", ">+......",
                                     ">+", ">++05.88", ">+05,880", ">+1E0000", ">+05.880 "}) {
    const DecodedReply decoded = Decode("#0", bad);
    EXPECT_TRUE(decoded.outcome == Outcome::corrupt || decoded.outcome == Outcome::unexpected)
        << bad;
    EXPECT_TRUE(decoded.fields.empty()) << bad;
    EXPECT_FALSE(decoded.reason.empty()) << bad;
  }
}

TEST(DconDecode, DisabledChannelsHaveNoValue) {
  const Settable missing = {{"enable_mask", std::int64_t{0b101}}};
  const DecodedReply two = Decode("#", ">+01.000+03.000", 3, missing);
  ASSERT_EQ(two.outcome, Outcome::ok) << two.reason;
  EXPECT_EQ(Select(two, {"#", Form::numbers, ReadAddress::Select::index, 0}).value, Value{1.0});
  EXPECT_EQ(Select(two, {"#", Form::numbers, ReadAddress::Select::index, 2}).value, Value{3.0});
  const Field off = Select(two, {"#", Form::numbers, ReadAddress::Select::index, 1});
  EXPECT_FALSE(HasValue(off.value));
  EXPECT_EQ(off.quality, Quality::bad_out_of_service);

  Settable zero = missing;
  zero.emplace_back("disabled", std::string("zero"));
  EXPECT_EQ(Decode("#", ">+01.000+03.000", 3, zero).outcome, Outcome::unexpected);
  const DecodedReply three = Decode("#", ">+01.000+00.000+03.000", 3, zero);
  EXPECT_EQ(three.fields[1].quality, Quality::bad_out_of_service);
  EXPECT_FALSE(HasValue(three.fields[1].value));
  EXPECT_EQ(three.fields[2].value, Value{3.0});
}

TEST(DconDecode, DecodesHexWords) {
  Settable volts = {{"format", std::string("hex")}, {"full_scale", 10.0}};
  const std::string_view eight = ">7FFF8000000040000000000000000000";
  EXPECT_EQ(Numbers(Decode("#", eight, 8, volts)),
            (std::vector<double>{10, -10, 0, 5, 0, 0, 0, 0}));
  const DecodedReply raw = Decode("$A", ">7FFF8000", 2);
  EXPECT_EQ(raw.fields[0].value, Value{std::int64_t{32767}});
  EXPECT_EQ(raw.fields[1].value, Value{std::int64_t{-32768}});
  const DecodedReply unipolar =
      Decode("$A", ">FFFF0000", 2, {{"hex_unsigned", true}, {"full_scale", 20.0}});
  EXPECT_EQ(Numbers(unipolar), (std::vector<double>{20, 0}));
  const Settable codes = {{"over", std::vector<std::string>{"7FFF"}}};
  EXPECT_EQ(Decode("$A", ">7FFF0001", 2, codes).fields[0].quality, Quality::bad_sensor_failure);
  EXPECT_EQ(Decode("$A", ">7FFG0001", 2).outcome, Outcome::corrupt);
}

TEST(DconDecode, DecodesDigitalWords) {
  EXPECT_EQ(Decode("@", ">0F00").fields[0].value, Value{std::uint64_t{0x0F00}});
  const DecodedReply status = Decode("$6", "!2A1500");
  ASSERT_EQ(status.outcome, Outcome::ok) << status.reason;
  EXPECT_EQ(status.form, Form::status);
  const auto pick = [&](ReadAddress::Select select, unsigned bit) {
    return Select(status, {"$6", Form::status, select, bit}).value;
  };
  EXPECT_EQ(pick(ReadAddress::Select::high, 0), Value{std::uint64_t{0x2A}});
  EXPECT_EQ(pick(ReadAddress::Select::low, 0), Value{std::uint64_t{0x15}});
  EXPECT_EQ(pick(ReadAddress::Select::bit, 0), Value{true});
  EXPECT_EQ(pick(ReadAddress::Select::bit, 1), Value{false});
  EXPECT_EQ(pick(ReadAddress::Select::bit, 13), Value{true});
  EXPECT_EQ(Decode("@", ">0F00", 0, {{"invert", std::int64_t{15}}}).fields[0].value,
            Value{std::uint64_t{0x0F0F}});
  EXPECT_EQ(Decode("$6", "!0F0001").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$L1", "!0F0000").fields[0].value, Value{std::uint64_t{0x0F00}});
  EXPECT_EQ(Decode("$L1", "!010F0000").fields[0].value, Value{std::uint64_t{0x0F00}});
  EXPECT_EQ(Decode("$L1", "!020F0000").outcome, Outcome::unexpected);
}

TEST(DconDecode, DecodesThreeFormsOfACommand) {
  EXPECT_EQ(Decode("#0", ">+05.880").fields[0].value, Value{5.88});
  EXPECT_EQ(Decode("#0", ">0001E240").fields[0].value, Value{std::uint64_t{123456}});
  EXPECT_EQ(Decode("#0", "!0100042").fields[0].value, Value{std::uint64_t{42}});
  EXPECT_EQ(Decode("#0", "!010001E240").fields[0].value, Value{std::uint64_t{123456}});
  EXPECT_EQ(Decode("#0", ">0001E240", 0, {}, Form::number).outcome, Outcome::corrupt);
  EXPECT_EQ(Decode("#0", ">+05.880", 0, {}, Form::counter).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#0", ">+05.880", 0, {}, Form::decimal).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#0", "!0200042", 0, {}, Form::decimal).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#0", "!010004A", 0, {}, Form::decimal).outcome, Outcome::corrupt);
}

TEST(DconDecode, DecodesACounterWithItsChecksumInFront) {
  const Settings settings = ReadSettings(MakeOptions({{"checksum", true}}));
  Command request;
  request.address = 1;
  request.text = "#0";
  const auto decode = [&](std::string_view wire) {
    return DecodeReply(request, Form::counter, 0, ToBytes(wire), settings);
  };
  EXPECT_EQ(decode(">D40000001E\r").fields[0].value, Value{std::uint64_t{30}});
  EXPECT_EQ(decode(">0001E240DA\r").fields[0].value, Value{std::uint64_t{123456}});
  for (unsigned count = 0; count < 0x10000; ++count) {
    const std::string data = "0000" + HexByte(static_cast<std::uint8_t>(count >> 8U)) +
                             HexByte(static_cast<std::uint8_t>(count));
    const DecodedReply decoded =
        DecodeReply(request, Form::counter, 0, BuildCounterReplyFront(data), settings);
    if (decoded.outcome == Outcome::ok) {
      ASSERT_EQ(decoded.fields[0].value, Value{std::uint64_t{count}});
    } else {
      ASSERT_NE(decoded.reason.find("counter_checksum"), std::string::npos);
    }
  }
}

TEST(DconDecode, DecodesReadbacks) {
  EXPECT_EQ(Decode("$80", "!0B+07.500", 0, {}, {}, 0x0B).fields[0].value, Value{7.5});
  EXPECT_EQ(Decode("$8", "!0107.500").fields[0].value, Value{7.5});
  EXPECT_EQ(Decode("$80", "!0A+07.500", 0, {}, {}, 0x0B).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$8", "!0107.50012").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("$6", "!01+07.500").fields[0].value, Value{7.5});
}

TEST(DconDecode, DecodesTextAndFlags) {
  EXPECT_EQ(Decode("$M", "!0B7060", 0, {}, {}, 0x0B).fields[0].value, Value{std::string("7060")});
  EXPECT_EQ(Decode("$2", "!01200600").fields[0].value, Value{std::string("200600")});
  EXPECT_EQ(Decode("$2", "!07200600", 0, {}, {}, 0).fields[0].value, Value{std::string("200600")});
  EXPECT_EQ(Decode("$2", "!07200600").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("~0", "!0104").fields[0].value, Value{std::uint64_t{4}});
  EXPECT_EQ(Decode("$B", "!011").fields[0].value, Value{std::uint64_t{1}});
  EXPECT_EQ(Decode("$6", "!01FF").fields[0].value, Value{std::uint64_t{0xFF}});
  EXPECT_EQ(Decode("$M", ">7060").outcome, Outcome::unexpected);
}

TEST(DconDecode, RecognisesRefusals) {
  for (const std::string_view reply : {"?01", "?"}) {
    EXPECT_EQ(Decode("#9", reply).outcome, Outcome::unsupported);
    EXPECT_EQ(Decode("#0+12.000", reply).outcome, Outcome::refused);
  }
  EXPECT_EQ(Decode("#9", "?02").outcome, Outcome::unexpected);
  EXPECT_NE(Decode("#9", "?01").reason.find("?01"), std::string::npos);
}

TEST(DconDecode, WritesAreConfirmedOnlyByTheirOwnReply) {
  EXPECT_EQ(Decode("#1301", ">").outcome, Outcome::ok);
  EXPECT_EQ(Decode("#1301", "!").outcome, Outcome::refused);
  EXPECT_NE(Decode("#1301", "!").reason.find("watchdog"), std::string::npos);
  EXPECT_EQ(Decode("#1301", "!01").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#1301", ">+05.880").outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#1301", "!01", 0, {{"write_ack_address", true}}).outcome, Outcome::ok);
  EXPECT_EQ(Decode("#1301", "!02", 0, {{"write_ack_address", true}}).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#C0+01.000", "!01").outcome, Outcome::ok);
  EXPECT_EQ(Decode("%0C400640", "!0C", 0, {}, {}, 0x0B).outcome, Outcome::ok);
  EXPECT_EQ(Decode("%0C400640", "!0B", 0, {}, {}, 0x0B).outcome, Outcome::unexpected);
}

TEST(DconDecode, RepliesThatCarryTheAddress) {
  const Settable trycom = {{"data_address", true}};
  EXPECT_EQ(Decode("#0", ">01+05.880", 0, trycom).fields[0].value, Value{5.88});
  EXPECT_EQ(Decode("#0", ">02+05.880", 0, trycom).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#0", ">+05.880", 0, trycom).outcome, Outcome::unexpected);
  EXPECT_EQ(Decode("#1301", ">01", 0, trycom).outcome, Outcome::ok);
}

TEST(DconDecode, AReplyToABroadcastIsUnexpected) {
  Command all;
  all.broadcast = true;
  all.text = "#";
  const DecodedReply decoded = DecodeReply(all, {}, 0, ToBytes(">\r"), ReadSettings(MakeOptions()));
  EXPECT_EQ(decoded.outcome, Outcome::unexpected);
}

}  // namespace
}  // namespace baudgate::protocols::dcon
