// Tests `Identification`, which asks a device for its name before polls and writes, and the
// findings about replies with unexpected text.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/identification.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/diagnosis/damage/examine.h"
#include "tests/protocols/telegram/support.h"
#include "tests/support/times.h"

namespace baudgate::protocols::telegram {
namespace {

class TelegramIdentification : public ::testing::Test {
 protected:
  TelegramIdentification() {
    description_.telegrams.resize(2);
    description_.telegrams[1].send.emplace();
    description_.telegrams[1].identity = "name";
    identity_.names = {"ACME 7"};
    identity_.others = {{"ACME8", "acme_8"}};
  }

  static Reply Says(const std::string& name) { return {.fields = {{"name", {.text = name}}}}; }

  Description description_{""};
  config::Identity identity_;
};

TEST_F(TelegramIdentification, IsDueUntilTheNameIsKnownAndAgainAfterSilence) {
  Identification identification(description_, identity_);
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnReply({.outcome = Outcome::busy});
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnReply(Says("ACME 7"));
  EXPECT_FALSE(identification.IsDue(kStart));
  identification.OnLost();
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnNoName(kStart);
  EXPECT_FALSE(identification.IsDue(kStart));
}

TEST_F(TelegramIdentification, ADeviceWithoutANameIsAskedLessAndLessOften) {
  Identification identification(description_, identity_);
  int asked = 0;
  for (Instant now = kStart; now < kStart + 24h; now += 1s) {
    if (!identification.IsDue(now)) continue;
    ++asked;
    identification.OnNoName(now);
    identification.OnLost();
  }
  EXPECT_GT(asked, 20);
  EXPECT_LT(asked, 30);
  EXPECT_FALSE(identification.trouble()) << "unknown, not wrong";
}

TEST_F(TelegramIdentification, IsDueAsLongAsAnotherDeviceAnswers) {
  Identification identification(description_, identity_);
  identification.OnReply(Says("ACME 8"));
  EXPECT_TRUE(identification.trouble());
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnNoName(kStart);
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnReply(Says("ACME 7"));
  EXPECT_FALSE(identification.trouble());
  EXPECT_FALSE(identification.IsDue(kStart));
}

TEST_F(TelegramIdentification, IsNeverDueWithoutATelegramForTheName) {
  description_.telegrams[1].identity.clear();
  EXPECT_FALSE(Identification(description_, identity_).IsDue(kStart));
}

constexpr char kResettable[] = R"(
device: resettable
identity: [ "ACME 7" ]
telegrams:
  name: { send: 'N\r', receive: 'ID {name:text}\r', reads: yes, identity: name, example: { send: 'N\r', receive: 'ID ACME 7\r' } }
  reset: { send: 'R\r', receive: 'OK\r', example: { send: 'R\r', receive: 'OK\r' } }
points: [ { name: reset, write: reset, access: w, type: bool } ]
)";

TEST(TelegramIdentity, AWriteToAnotherDeviceIsRefused) {
  config::Device device = Described(kResettable);
  device.identity.others = {{"ACME8", "acme_8"}};
  Talk talk(TelegramProtocol(), device);
  const auto other = [](View request) {
    return ToBytes(AsText(request) == "N\r" ? "ID ACME 8\r" : "OK\r");
  };
  EXPECT_EQ(talk.Run(Write(0, true), other).outcome, Outcome::refused);
  EXPECT_EQ(talk.asked, std::vector<Bytes>{ToBytes("N\r")});
}

using enum Symptom;

Finding LookAtTelegram(const std::string& profile, const std::string& request,
                       const std::string& heard) {
  const Protocol& protocol = TelegramProtocol();
  const config::Device device = ShippedDevice(protocol, profile);
  const ParsedOptions options = ParseOptions(protocol, device.options);
  const Bytes asked = ToBytes(request);
  const auto conversation = protocol.make_conversation(device, options, nullptr);
  const Expectation expect =
      asked.empty() ? conversation->Listens()->expect : protocol.expect(asked, options);
  const Bytes bytes = ToBytes(heard);
  const diagnosis::Arrival arrivals[] = {{0, 20ms}};
  return diagnosis::Examine({.protocol = &protocol,
                             .options = &options,
                             .request = asked,
                             .expect = &expect,
                             .outcome = Outcome::corrupt,
                             .heard = bytes,
                             .arrivals = arrivals,
                             .reply = 100ms,
                             .gap = 50ms});
}

TEST(TelegramRecognise, ReportsUnexpectedReplies) {
  const struct {
    std::string profile;
    std::string request;
    std::string heard;
    Symptom symptom;
    std::string cause;
  } rows[] = {
      {"mt-sics", "SI\r\n", "N      100.00 g  \r\n", other_form,
       "its reply to weight is not as described ('N      100.00 g')"},
      {"mt-sics", "SI\r\n", "S S     10.00 g\r\n", bytes_lost,
       "its reply to weight is not as described ('S S     10.00 g')"},
      {"scpi-instrument", "READ?\n", "1.23456789E-03\r\n", other_setting,
       "its reply to reading has no sign in front ('1.23456789E-03')"},
      {"nmea-0183-weather", "", "$WIMWV,214.8,R,0.1,N,A\r\n", other_setting,
       "its messages carry no check value ('$WIMWV,214.8,R,0.1,N,A')"},
      {"nmea-0183-weather", "", "$WIMWV,214.8,R,0.1,N,A*0A\r\n", bad_check, "a text"},
      {"owen-mv110-8a-telegrams", "#0386\r", ">+04.803+02.819F3\r", other_form,
       "only 2 of the 8 numbers in the profile came ('>+04.803+02.819F3')"},
      {"owen-mv110-8a-telegrams", "#0386\r",
       ">+04.800+02.810-00.720+00.350+09.000-09.300+03.200+07.100\r", other_setting,
       "its replies carry no check value ('>+04.800+02.810-00.720+0...')"},
      {"mt-sics", "SI\r\n", "\r\nplc7 login: ", text, "'\\r\\nplc7 login: '"},
      {"scpi-instrument", "READ?\n", "+1.22097243E-03 VDC\n", other_setting,
       "its reply to reading has a unit after the number ('VDC')"},
      {"lauda-thermostat", "IN_PV_00\r\n", "PV 24.60 C\r\n", other_form,
       "its reply to value is not as described ('PV 24.60 C')"},
      {"nmea-0183-weather", "", "$WIMWV,214.8,R,0.1,N,A*09\r\n", bad_check,
       "its check value is computed in another way (xor8 over other characters fits)"},
      {"owen-mv110-8a-telegrams", "#0386\r",
       ">+04.800+02.810-00.720+00.350+09.000-09.300+03.200+07.1003E\r", bad_check,
       "its check value is computed in another way (xor8 fits)"},
  };
  for (const auto& row : rows) {
    const Finding finding = LookAtTelegram(row.profile, row.request, row.heard);
    EXPECT_EQ(Name(finding.symptom), Name(row.symptom)) << row.heard;
    EXPECT_EQ(finding.cause, row.cause) << row.heard;
  }
}

/// Damage would give a different difference each time.
TEST(TelegramRecognise, ReportsAConstantDifferenceOfACheckValue) {
  const std::string remedy =
      "the check value differs from xor8 always by 27: check whether the profile fits the firmware "
      "of the device";
  for (const char* const heard :
       {"$WIMWV,214.8,R,0.1,N,A*0A\r\n", "$WIMWV,215.8,R,0.1,N,A*0B\r\n"}) {
    EXPECT_EQ(LookAtTelegram("nmea-0183-weather", "", heard).remedy, remedy);
  }
}

}  // namespace
}  // namespace baudgate::protocols::telegram
