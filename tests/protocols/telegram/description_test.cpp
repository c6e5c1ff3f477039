// What `check` says of a description: each error with its place, and a sentence for whatever a
// damaged one holds.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/protocols/telegram/support.h"
#include "tests/support/file_cases.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr char kGood[] = R"(device: d
telegrams:
  weight:
    send: 'S{address:02d}\r\n'
    receive: 'S{address:02d} {state:char} {weight:8decimal} {unit:word}{checksum:02X}\r\n'
    checksum: sum8
    codes: { state: { 'S': good, 'D': uncertain } }
    reads: yes
    example: { send: 'S01\r\n', receive: 'S01 S    12.50 kg8F\r\n', weight: 12.5, unit: kg }
points:
  - { name: weight, read: weight.weight, type: float32 }
)";

std::string Sentences(const config::LoadedProfile& loaded) {
  std::string text;
  for (const auto& problem : loaded.problems) text += ToString(problem) + "\n";
  return text;
}

TEST(TelegramDescription, AGoodOneHasNoProblem) { EXPECT_EQ(Sentences(LoadText(kGood)), ""); }

constexpr char kStatus[] = R"(device: d
telegrams:
  data:
    send: 'hex 10 {node:4text}'
    receive: 'hex 68 {flags:uint16_be} {state:byte} {checksum:03d}'
    checksum: sum8
    codes: { state: { '0x00': good, '\x01': fault } }
    reads: yes
    example: { send: 'hex 10 30 31 31 31', receive: 'hex 68 01 00 00 31 30 35', flags: 256, state: '0x00' }
points:
  - { name: flag, read: 'data(node=0111).flags[b15]', type: bool }
)";

TEST(TelegramDescription, EveryErrorIsASentenceWithItsPlace) {
  EXPECT_EQ(Sentences(LoadText(kStatus)), "");
  const auto cases = ReadFileCases("tests/protocols/telegram/description.txt");
  EXPECT_GT(cases.size(), 40U);
  for (const FileCase& one : cases) {
    SCOPED_TRACE(one.place);
    const auto lines = [](std::string text) {
      for (const auto& [sign, meant] :
           {std::pair<std::string, const char*>("¶", "\n"), {"␣", " "}}) {
        for (std::size_t at = 0; (at = text.find(sign, at)) != std::string::npos;) {
          text.replace(at, sign.size(), meant);
        }
      }
      return text;
    };
    std::string text = one.head == "good" ? kGood : kStatus;
    const std::string was = lines(one.given.at(0));
    const std::size_t at = text.find(was);
    ASSERT_NE(at, std::string::npos) << was;
    text.replace(at, was.size(), lines(one.given.at(1)));
    const std::string said = Sentences(LoadText(text));
    EXPECT_NE(said.find(one.results.at(0).second), std::string::npos) << said;
  }
}

/// A device may leave the check value out of its answers, if its description says so; an answer
/// of fixed bytes has none to lose.
TEST(TelegramDescription, AnAnswerHasNoCheckValueOnlyIfThatIsSaid) {
  const auto said = [](const std::string& checksum, const std::string& receive) {
    return Sentences(LoadText(
        "device: d\ntelegrams:\n  a:\n    send: 'R{node:1text}{checksum:02X}'\n    checksum: " +
        checksum + "\n    receive: '" + receive +
        "'\n    example: { send: 'R163', receive: '\\x061' }\npoints: []\n"));
  };
  const std::string wrong = "has no {checksum}, and 'checksum' is xor8";
  EXPECT_NE(said("xor8", "\\x06{v:1d}").find(wrong), std::string::npos);
  EXPECT_EQ(said("xor8", "\\x061").find(wrong), std::string::npos);
  EXPECT_EQ(said("xor8", "\\x06{node:1text}").find(wrong), std::string::npos);
  EXPECT_EQ(said("{ kind: xor8, answers: no }", "\\x06{v:1d}").find(wrong), std::string::npos);
}

TEST(TelegramDoubts, AreToldWhereAValueWouldBeBadOrShifted) {
  const std::pair<const char*, const char*> kRows[] = {
      {"read: data(node=0111).flags, type: uint16", ""},
      {"read: data(node=0111).flags, type: int16", "has type int16, which cannot hold all"},
      {"read: data(node=0111).flags, type: int8", "up to 65535 on the line"},
      {"read: data(node=0111).flags, type: bool", "has type bool, which cannot hold all"},
      {"read: data(node=0111).flags, type: float32", ""},
      {"read: data(node=0111).flags, type: uint16, simulate: 200000",
       "has 'simulate' 200000, and its field 'flags' cannot say it"},
      {"read: 'data(node=0111).flags[b0-b7]', type: int8", "up to 255 on the line"},
      {"read: 'data(node=0111).flags[b0-b7]', type: uint8", ""},
  };
  for (const auto& [point, says] : kRows) {
    std::string text = kStatus;
    const auto at = text.find("read: 'data");
    text.replace(at, text.find(" }", at) - at, point);
    std::string said;
    for (const ConfigRemark& doubt : TelegramProtocol().doubts(Described(text)))
      said += doubt.text + "\n";
    EXPECT_EQ(said.empty(), std::string(says).empty()) << point << ": " << said;
    EXPECT_NE(said.find(says), std::string::npos) << point << ": " << said;
  }
}

TEST(TelegramDescription, WhatAllDevicesLackHasItsFileAndNoEcho) {
  std::string text = kGood;
  text.replace(0, 10, "device: d\nparameters: { nod: 1 }\n");
  EXPECT_EQ(Sentences(LoadText(text)),
            "p.yaml:1:1: error: a device of this type has a parameter 'nod', which no telegram "
            "has\n");
  EXPECT_EQ(Sentences(LoadText("device: d\ntelegram: {}\npoints: []\n")).find("'telegrams': they"),
            std::string::npos);
}

TEST(TelegramDescription, AllErrorsAreSaidAtOnce) {
  std::string text = kGood;
  text.replace(text.find("sum8"), 4, "sum9");
  text.replace(text.find("good"), 4, "goood");
  text.replace(text.find("send: 'S{address:02d}"), 21, "send: 'S{address:02q}");
  EXPECT_GE(LoadText(text).problems.size(), 3U);
}

/// Five hundred texts that somebody has damaged: none brings the program down, none is taken for
/// good without being one, and each error is one line of words.
TEST(TelegramDescription, EveryMutationGivesSentencesAndNeverACrash) {
  std::vector<std::string> sources = {kGood};
  for (const auto& entry : std::filesystem::directory_iterator("config/profiles/telegram")) {
    std::ifstream file(entry.path());
    sources.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  ASSERT_GE(sources.size(), 6U);
  constexpr std::string_view kPieces[] = {"{",           "}",
                                          "'",           "\\",
                                          ":",           "\\x",
                                          "hex ",        "{address:02X}",
                                          "{value}",     "{:bytes}",
                                          "[",           "]",
                                          "size: 9\n",   "size_at: 2\n",
                                          "listen: yes", "before: all",
                                          "99999999999", "-1",
                                          "\t",          "\xC3\xA9",
                                          "%s%n",        "checksum",
                                          "{password}",  "codes: {}"};
  std::mt19937 random(20261127);
  int refused = 0;
  for (int round = 0; round < 500; ++round) {
    std::string text = sources[random() % sources.size()];
    for (auto count = 1 + random() % 3; count > 0 && !text.empty(); --count) {
      const std::size_t at = random() % text.size();
      const std::size_t length = std::min<std::size_t>(random() % 12, text.size() - at);
      switch (random() % 4) {
        case 0:
          text.erase(at, length);
          break;
        case 1:
          text.insert(at, kPieces[random() % std::size(kPieces)]);
          break;
        case 2:
          text.replace(at, length, kPieces[random() % std::size(kPieces)]);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), length));
          break;
      }
    }
    const config::LoadedProfile loaded = LoadText(text);
    for (const auto& problem : loaded.problems) {
      const std::string sentence = ToString(problem);
      EXPECT_FALSE(problem.message.empty());
      EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
    }
    refused += loaded.ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 200);
}

config::Loaded LoadConfig(const std::string& device) {
  config::Catalog catalog;
  catalog.protocols["telegram"] = &TelegramProtocol();
  catalog.profile_dirs = {"config/profiles"};
  return config::LoadText(
      "lines:\n  - name: bench\n    port: /dev/null\n    protocol: telegram\n    devices:\n      - "
      "{ " +
          device + " }\n",
      "c.yaml", catalog);
}

TEST(TelegramConfig, ParametersOfADeviceArePutOverThoseOfItsProfile) {
  const config::Loaded loaded = LoadConfig(
      "name: meter, address: 1, profile: scpi-instrument, parameters: { query: \"FETC?\" }");
  for (const auto& problem : loaded.problems) ADD_FAILURE() << ToString(problem);
  Talk talk(TelegramProtocol(), loaded.config.lines[0].devices[0]);
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_EQ(AsText(talk.request().bytes), "*IDN?\n") << "who it is goes first";
  talk.Reply(Poll(0), ToBytes("HEWLETT-PACKARD,34401A,0,11-5-2\r\n"));
  EXPECT_EQ(AsText(talk.Ask(Poll(0))->bytes), "FETC?\n");
}

TEST(TelegramConfig, WhatADeviceLacksIsSaidAtTheDevice) {
  const config::Loaded loaded = LoadConfig(
      "name: meter, address: 1, profile: scpi-instrument, parameters: { qury: \"FETC?\" }");
  std::string said;
  for (const auto& problem : loaded.problems) said += ToString(problem) + "\n";
  EXPECT_EQ(said,
            "c.yaml:6:9: error: device 'meter' has a parameter 'qury', which no telegram has; "
            "did you mean 'query'? fields that are sent: query\n");
}

TEST(TelegramConfig, OnlyADeviceThatIsAddressedNeedsAnAddress) {
  const config::Loaded sics = LoadConfig("name: balance, profile: mt-sics");
  for (const auto& problem : sics.problems) ADD_FAILURE() << ToString(problem);
  EXPECT_EQ(sics.config.lines[0].devices[0].address, kNoAddress);
  const config::Loaded owen = LoadConfig("name: tank, profile: owen-mv110-8a-telegrams");
  ASSERT_FALSE(owen.problems.empty());
  EXPECT_NE(ToString(owen.problems[0]).find("give the device its 'address'"), std::string::npos)
      << ToString(owen.problems[0]);
}

TEST(TelegramConfig, ASameDescriptionIsTheSameDevice) {
  const auto options = [](const std::string& device) {
    return LoadConfig(device).config.lines.at(0).devices.at(0).options;
  };
  const std::string sics = "name: a, address: 1, profile: mt-sics";
  EXPECT_EQ(options(sics), options(sics));
  EXPECT_FALSE(options(sics) == options("name: a, address: 1, profile: lauda-thermostat"));
}

}  // namespace
}  // namespace baudgate::protocols::telegram
