// Tests conversations of described devices: several telegrams, writes, echoes, names, simulated
// devices.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "protocols/telegram/description.h"
#include "protocols/telegram/rules.h"
#include "tests/protocols/telegram/support.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr char kMeter[] = R"(
device: meter
parameters: { user: "P1" }
telegrams:
  wake:
    send: '\x00\x00'
    reads: yes
    example: { send: '\x00\x00' }
  login:
    send: 'LOGIN {user:word} {password:8text}\r'
    receive: 'OK\r'
    reads: yes
    once: yes
    example: { send: 'LOGIN P1 12345678\r', receive: 'OK\r' }
  select:
    send: '/{address:02d}{channel:02d}\r'
    receive: 'SEL {channel:d}\r'
    reads: yes
    pause: 50ms
    example: { send: '/0101\r', receive: 'SEL 1\r' }
  energy:
    send: '?E\r'
    receive: 'E={value:+7.decimal} {flags:02X}\r'
    refused: 'ERR{code:d}\r'
    reads: yes
    strict: yes
    wait: 2s
    before: [ wake, login, select ]
    behind: ack
    example: { send: '?E\r', receive: 'E=+0012.5 81\r', value: 12.5, flags: 129 }
  ack:
    send: '\x06'
    reads: yes
    example: { send: '\x06' }
  limit:
    send: 'L={value:03d}\r'
    receive: 'L={value:03d}\r'
    refused: 'ERR{code:d}\r'
    example: { send: 'L=050\r', receive: 'L=050\r' }
  read_limit:
    send: '?L\r'
    receive: '{value:03d}\r'
    reads: yes
    example: { send: '?L\r', receive: '050\r', value: 50 }
  reset:
    send: 'RST\r'
    receive: 'DONE\r'
    example: { send: 'RST\r', receive: 'DONE\r' }
points:
  - { name: energy, read: energy(channel=3).value, type: float32 }
  - { name: alarm, read: 'energy(channel=3).flags[b7]', type: bool }
  - { name: mode, read: 'energy(channel=3).flags[b0-b3]', type: uint16 }
  - { name: limit, read: read_limit.value, write: limit, access: rw, type: uint16, min: 0, max: 100 }
  - { name: reset, write: reset, access: w, type: bool }
)";

config::Device Meter() { return Described(kMeter, {{"password", std::string("S3CRET")}}); }

std::vector<std::string> Shown(const std::vector<Bytes>& requests) {
  std::vector<std::string> texts;
  for (const Bytes& request : requests) texts.emplace_back(AsText(request));
  return texts;
}

using Texts = std::vector<std::string>;
const std::string kWake(2, '\0');
const std::string kLogin = "LOGIN P1 S3CRET  \r";

Answer Play(Talk& talk, const Task& task, Texts answers) {
  Answer answer;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto request = talk.Ask(task);
    if (!request) return {Outcome::unsupported, request.error()};
    if (request->expect.reply == Expectation::Reply::none) {
      if (talk->OnSent(task, *request, {}) != Then::ask_again) return answer;
      continue;
    }
    const std::string text = answers.empty() ? "" : answers.front();
    if (!answers.empty()) answers.erase(answers.begin());
    answer = talk.Reply(task, ToBytes(text));
    if (answer.then != Then::ask_again) return answer;
  }
  return answer;
}

TEST(TelegramExchange, PerformsAllStepsOfASession) {
  Talk talk(TelegramProtocol(), Meter());
  Answer answer = Play(talk, Poll(0), {"OK\r", "SEL 3\r", "E=+0012.5 81\r"});
  EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  EXPECT_EQ(Shown(talk.asked), (Texts{kWake, kLogin, "/0103\r", "?E\r", "\x06"}));
  talk.asked.clear();
  // The login stays valid until an exchange fails.
  Play(talk, Poll(0), {"SEL 3\r", ""});
  EXPECT_EQ(Shown(talk.asked), (Texts{kWake, "/0103\r", "?E\r", "\x06"}));
  talk.asked.clear();
  Play(talk, Poll(0), {"OK\r", "SEL 3\r", "E=+0012.5 81\r"});
  EXPECT_EQ(Shown(talk.asked), (Texts{kWake, kLogin, "/0103\r", "?E\r", "\x06"}));
}

TEST(TelegramExchange, ValuesOfOneTelegramAreReadTogether) {
  const config::Device device = Meter();
  Talk talk(TelegramProtocol(), device);
  Answer answer;
  for (int step = 0; step < kMostSteps && AsText(talk.request().bytes) != "?E\r"; ++step) {
    answer = talk.Exchange(Poll(0), [&](View request) {
      const std::string text(AsText(request));
      return ToBytes(text == kLogin ? "OK\r" : text == "/0103\r" ? "SEL 3\r" : "E=+0012.5 81\r");
    });
  }
  EXPECT_EQ(Said(device, answer), "energy 12.5 good; alarm true good; mode 1 good");
  EXPECT_EQ(Said(device,
                 AnswerTo(TelegramProtocol(), device, ToBytes("?E\r"), ToBytes("E=+00I2.5 81\r"))),
            "corrupt");
}

TEST(TelegramExchange, TheReplyMustRepeatTheSentValue) {
  const config::Device device = Meter();
  const auto heard = [&](const char* answer) {
    return AnswerTo(TelegramProtocol(), device, ToBytes("/0103\r"), ToBytes(answer)).outcome;
  };
  EXPECT_EQ(heard("SEL 3\r"), Outcome::ok);
  EXPECT_EQ(heard("SEL 4\r"), Outcome::unexpected);
  Talk talk(TelegramProtocol(), device);
  EXPECT_EQ(Play(talk, Write(3, std::int64_t{50}), {"L=050\r"}).outcome, Outcome::ok);
  EXPECT_EQ(Play(talk, Write(3, std::int64_t{50}), {"L=051\r"}).outcome, Outcome::unexpected);
}

TEST(TelegramExchange, AFailedStepEndsTheExchangeAndClosesTheSession) {
  Talk talk(TelegramProtocol(), Meter());
  const Answer answer = Play(talk, Poll(0), {"OK\r", ""});
  EXPECT_FALSE(ProvesLife(answer.outcome));
  EXPECT_EQ(Shown(talk.asked), (Texts{kWake, kLogin, "/0103\r", "\x06"}))
      << "what was begun is closed";
}

TEST(TelegramExchange, PausesAndReplyTimesAreSetInTheRequest) {
  Talk talk(TelegramProtocol(), Meter());
  talk.Ask(Poll(0));
  talk->OnSent(Poll(0), talk.request(), {});
  talk.Ask(Poll(0));
  talk.Reply(Poll(0), ToBytes("OK\r"));
  EXPECT_EQ(talk.Ask(Poll(0))->quiet, Duration(50ms));
  talk.Reply(Poll(0), ToBytes("SEL 3\r"));
  EXPECT_EQ(talk.Ask(Poll(0))->reply, Duration(2s));
}

TEST(TelegramWrites, AreNotRepeatableAndRefuseOtherValues) {
  Talk talk(TelegramProtocol(), Meter());
  EXPECT_FALSE(talk.Ask(Write(3, std::int64_t{50}))->expect.repeatable);
  EXPECT_FALSE(talk.Ask(Write(3, std::int64_t{1000}))) << "three digits";
  EXPECT_FALSE(talk.Ask(Write(4, false))) << "a command is true";
  EXPECT_EQ(AsText(talk.Ask(Write(4, true))->bytes), "RST\r");
  EXPECT_EQ(Play(talk, Write(3, std::int64_t{50}), {"ERR6\r"}).outcome, Outcome::refused);
  EXPECT_TRUE(talk.Ask(Poll(1))->expect.repeatable);
}

TEST(TelegramSecrets, ThePasswordIsMaskedEverywhere) {
  const config::Device device = Meter();
  const Expectation expect = Expect(ToBytes(kLogin), ReadSettings(device.options));
  ASSERT_EQ(expect.secrets.size(), 1U);
  EXPECT_EQ(kLogin.substr(expect.secrets[0].first, expect.secrets[0].second), "S3CRET  ");
  config::Device wrong = Described(kMeter, {{"password", std::string("TOOLONGAPASSWORD")}});
  for (const ConfigRemark& fault : TelegramProtocol().faults(wrong)) {
    EXPECT_EQ(fault.text.find("TOOLONG"), std::string::npos) << fault.text;
  }
  EXPECT_FALSE(TelegramProtocol().faults(wrong).empty());
}

TEST(TelegramParameters, MissingParametersAreNamed) {
  config::Device device = Meter();
  EXPECT_TRUE(TelegramProtocol().faults(device).empty());
  device.options.Set("parameters", config::Pairs{{"usr", "P1"}});
  std::string said;
  for (const ConfigRemark& fault : TelegramProtocol().faults(device)) said += fault.text + "\n";
  EXPECT_NE(said.find("needs a value for {user} of telegram 'login'"), std::string::npos) << said;
  EXPECT_NE(said.find("has a parameter 'usr', which is not a field of any telegram"),
            std::string::npos)
      << said;
}

constexpr char kPlaced[] = R"(
device: indicator
telegrams:
  weight:
    send: 'W\r'
    receive: '{:4text}{weight:6decimal}{:4text}\r'
    reads: yes
    example: { send: 'W\r', receive: 'ST,G 12.50 kg \r', weight: 12.5 }
points:
  - { name: weight, read: weight.weight, type: float32 }
)";

TEST(TelegramNumbers, CharactersNextToACutNumberMakeItBad) {
  const config::Device device = Described(kPlaced);
  const std::pair<const char*, const char*> kRows[] = {
      {"ST,G 12.50 kg \r", "weight 12.5 good"},
      {"ST,G-12.50 kg \r", "weight -12.5 good"},
      {"ST,112.500 kg \r", "weight bad: sensor failure"},
      {"ST,-12.500 kg \r", "weight bad: sensor failure"},
      {"ST,(12.500 kg \r", "weight bad: sensor failure"},
      {"ST,G 12.505kg \r", "weight bad: sensor failure"},
      {"ST,G 12.50-kg \r", "weight bad: sensor failure"},
      {"ST,G 12.50 - k\r", "weight bad: sensor failure"},
      {"ST,G       kg \r", "weight bad: sensor failure"},
      {"ST,G 12,50 kg \r", "weight bad: sensor failure"},
      {"ST,G 1 250 kg \r", "weight bad: sensor failure"},
      {"ST,G ----- kg \r", "weight bad: sensor failure"},
      {"ST,G12.50 kg \r", "corrupt"},
  };
  for (const auto& [answer, said] : kRows) {
    EXPECT_EQ(Said(device, AnswerTo(TelegramProtocol(), device, ToBytes("W\r"), ToBytes(answer))),
              said)
        << answer;
  }
}

TEST(TelegramNumbers, WithoutTheirFirstCharactersAreNeverGood) {
  const config::Device device = ShippedDevice(TelegramProtocol(), "scpi-instrument");
  const std::string whole = "-1.23456789E-03\r\n";
  EXPECT_EQ(Said(device, AnswerTo(TelegramProtocol(), device, ToBytes("READ?\n"), ToBytes(whole))),
            "reading -0.00123456789 good");
  for (std::size_t lost = 1; lost < whole.size(); ++lost) {
    for (const char* noise : {"", "x", "\x80"}) {
      const Answer answer = AnswerTo(TelegramProtocol(), device, ToBytes("READ?\n"),
                                     ToBytes(noise + whole.substr(lost)));
      for (const Reading& reading : answer.readings) {
        EXPECT_FALSE(IsGood(reading.quality)) << noise << whole.substr(lost);
      }
    }
  }
}

constexpr char kByPlace[] = R"(
device: heat meter
telegrams:
  data:
    send: 'hex 10 {address:uint8} 5B'
    size: 12
    fields:
      address: { at: 1, format: uint8 }
      energy: { at: 2, format: uint32_le }
      flow: { at: 8, format: int16_be }
      status: { at: 11, format: uint8 }
    codes: { flow: { '0x7FFF': over, '-32768': open } }
    reads: yes
    example: { send: 'hex 10 01 5B', receive: 'hex 68 01 39 30 00 00 AA BB FF FE CC 05', energy: 12345, flow: -2 }
points:
  - { name: energy, read: data.energy, type: uint32 }
  - { name: flow, read: data.flow, type: float32, scale: 0.1 }
  - { name: fault, read: 'data.status[b2]', type: bool }
)";

TEST(TelegramFields, AreReadFromTheirPlace) {
  const config::Device device = Described(kByPlace);
  const auto said = [&](const char* answer) {
    return Said(device,
                AnswerTo(TelegramProtocol(), device, *ParseHex("10 01 5B"), *ParseHex(answer)));
  };
  EXPECT_EQ(said("68 01 39 30 00 00 AA BB FF FE CC 05"),
            "energy 12345 good; flow -2 good; fault true good");
  EXPECT_EQ(said("68 01 39 30 00 00 AA BB 7F FF CC 00"),
            "energy 12345 good; flow bad: sensor failure, over range; fault false good");
  EXPECT_EQ(said("68 02 39 30 00 00 AA BB FF FE CC 05"), "unexpected");
  EXPECT_EQ(said("68 01 39 30 00 00 AA BB FF FE CC"), "partial");
}

constexpr char kNamed[] = R"(
device: named
identity: [ "ACME 7" ]
telegrams:
  value: { send: 'V\r', receive: '={value:+decimal}\r', reads: yes, example: { send: 'V\r', receive: '=+5\r', value: 5 } }
  name: { send: 'N\r', receive: 'ID {name:text}\r', reads: yes, identity: name, example: { send: 'N\r', receive: 'ID ACME 7\r' } }
points: [ { name: value, read: value.value, type: float32 } ]
)";

TEST(TelegramIdentity, IsReadBeforeTheFirstPollAndAfterSilence) {
  Talk talk(TelegramProtocol(), Described(kNamed));
  EXPECT_EQ(Play(talk, Poll(0), {"ID ACME 7\r", "=+5\r"}).outcome, Outcome::ok);
  EXPECT_EQ(Shown(talk.asked), (Texts{"N\r", "V\r"}));
  Play(talk, Poll(0), {""});
  Play(talk, Poll(0), {"ID ACME 7\r", "=+5\r"});
  EXPECT_EQ(Shown(talk.asked), (Texts{"N\r", "V\r", "V\r", "N\r", "V\r"}));
  EXPECT_TRUE(talk.Ask(Probe())->steady);
}

TEST(TelegramIdentity, ADeviceWithoutItIsStillPolled) {
  Talk talk(TelegramProtocol(), Described(kNamed));
  const Answer answer = Play(talk, Poll(0), {"", "=+5\r"});
  EXPECT_EQ(Shown(talk.asked), (Texts{"N\r", "V\r"}));
  EXPECT_FALSE(talk->trouble());
  static_cast<void>(answer);
}

config::Catalog Installed() {
  config::Catalog catalog;
  catalog.protocols["telegram"] = &TelegramProtocol();
  catalog.profile_dirs = {"config/profiles"};
  return catalog;
}

std::vector<std::string> ProfileNames() {
  std::vector<std::string> names;
  for (const auto& file : Installed().Profiles("telegram")) names.push_back(file.name);
  return names;
}

class TelegramProfile : public ::testing::TestWithParam<std::string> {};

TEST_P(TelegramProfile, EveryPointIsAnsweredByTheTwin) {
  const auto loaded = config::LoadProfile(GetParam(), TelegramProtocol(), Installed());
  for (const auto& problem : loaded.problems) ADD_FAILURE() << config::ToString(problem);
  const config::Device device =
      config::DeviceFromProfile(loaded.profile, TelegramProtocol(), "device", "1");
  FixedValues values;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    ASSERT_TRUE(point.simulate) << point.name;
    EXPECT_FALSE(point.description->empty()) << point.name;
    values.values[i] = point.simulate->text                  ? Value(*point.simulate->text)
                       : point.type == config::Type::boolean ? Value(point.simulate->low != 0)
                                                             : Value(point.simulate->low);
  }
  const auto twin = TelegramProtocol().make_twin(device, values);
  Talk talk(TelegramProtocol(), device);
  std::vector<Reading> readings;
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    Answer answer = talk.Run(Poll(query), *twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
    readings.insert(readings.end(), answer.readings.begin(), answer.readings.end());
  }
  if (const Standing* standing = talk->Listens()) {
    EXPECT_TRUE(twin->Raise({}, {}));
    for (Bytes said = twin->Say({}); !said.empty(); said = twin->Say({})) {
      EXPECT_EQ(CutFrame(standing->rule, standing->expect, said), said) << Printable(said);
      const Answer answer = talk->OnUnasked(said, {});
      readings.insert(readings.end(), answer.readings.begin(), answer.readings.end());
    }
  }
  std::size_t read = 0;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (device.points[i].access == config::Access::write) continue;
    ++read;
    const auto found = std::ranges::find(readings, i, &Reading::point);
    ASSERT_NE(found, readings.end()) << device.points[i].name;
    EXPECT_EQ(found->quality, Quality::good) << device.points[i].name;
    EXPECT_EQ(ToText(found->value), ToText(values.values[i])) << device.points[i].name;
  }
  EXPECT_GT(read, 0U);
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (device.points[i].access == config::Access::read) continue;
    const bool flag = device.points[i].type == config::Type::boolean;
    const Answer answer = talk.Run(Write(i, flag ? Value(true) : Value(30.5)), *twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << device.points[i].name << ": " << answer.reason;
    EXPECT_EQ(ToDouble(values.values[i]), flag ? 1 : 30.5) << device.points[i].name;
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, TelegramProfile, ::testing::ValuesIn(ProfileNames()),
                         [](const ::testing::TestParamInfo<std::string>& info) {
                           std::string name = info.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(TelegramProfiles, DocumentedProfilesAreShipped) {
  const std::vector<std::string> names = ProfileNames();
  for (const char* name : {"mt-sics", "nmea-0183-weather", "scpi-instrument",
                           "owen-mv110-8a-telegrams", "lauda-thermostat"}) {
    EXPECT_NE(std::ranges::find(names, name), names.end()) << name;
  }
}

TEST(TelegramTwin, IsSilentToOtherAddressesAndMayReplyAsAnother) {
  const config::Device device = Described(kByPlace);
  FixedValues values;
  const auto twin = TelegramProtocol().make_twin(device, values);
  EXPECT_TRUE(twin->Answer(*ParseHex("10 02 5B"), {}).empty());
  EXPECT_EQ(twin->Answer(*ParseHex("10 01 5B"), {})[1], 1);
  twin->ReplyAs("9");
  EXPECT_EQ(twin->Answer(*ParseHex("10 01 5B"), {})[1], 9);
}

}  // namespace
}  // namespace baudgate::protocols::telegram
