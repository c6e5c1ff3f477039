// Tests to which point an answer belongs. A question is the list of all telegrams that were sent
// for the answer.
// SPDX-License-Identifier: Apache-2.0
#include <map>

#include "tests/protocols/telegram/support.h"

namespace baudgate::protocols::telegram {
namespace {

std::string Selecting(const std::string& telegrams, const std::string& val,
                      const std::string& points, const std::string& parameters = "n: 1") {
  return "device: d\nparameters: { " + parameters + " }\ntelegrams:\n" + telegrams + "  val: { " +
         val +
         ", reads: yes, example: " + "{ send: 'READ\\r', receive: '=+5\\r', v: 5 } }\npoints:\n" +
         points;
}
const std::string kSel = "  sel: { send: 'CH{n:d}\\r', reads: yes, example: { send: 'CH1\\r' } }\n";
const std::string kAnsweredSel =
    "  sel: { send: 'CH{n:d}\\r', receive: ['OK {state:char}\\r', 'OK\\r'], refused: 'NO\\r', "
    "reads: yes, codes: { state: { 'G': good, 'E': fault } }, "
    "example: { send: 'CH1\\r', receive: 'OK\\r' } }\n";
const std::string kRange =
    "  range: { send: 'RNG{r:d}\\r', reads: yes, example: { send: 'RNG1\\r' } }\n";
const std::string kVal = "send: 'READ\\r', receive: '={v:+decimal}\\r'";
const std::string kBoth =
    "  - { name: one, read: val(n=1).v, type: float32 }\n"
    "  - { name: two, read: val(n=2).v, type: float32 }\n";

/// A meter whose channel N returns 10 x N x the selected range. "CHN" selects a channel, "RNGN" a
/// range.
struct Selectable {
  int channel = 7;
  int range = 1;
  bool answers = false;
  Bytes operator()(View request) {
    const std::string text(AsText(request));
    if (text.starts_with("RNG")) range = text[3] - '0';
    if (text.starts_with("CH")) channel = text[2] - '0';
    if (text.starts_with("CH") && answers) return ToBytes("OK\r");
    if (text != "READ\r") return {};
    return ToBytes("=+" + std::to_string(10 * channel * range) + "\r");
  }
};

std::map<std::string, std::string> Readings(const config::Device& device, const Wire& wire) {
  std::map<std::string, std::string> said;
  Talk talk(TelegramProtocol(), device);
  const std::size_t queries = talk->Queries().size();
  for (std::size_t poll = 0; poll < 4 * queries; ++poll) {
    const std::size_t query = poll < 2 * queries ? poll % queries : queries - 1 - poll % queries;
    for (const Reading& reading : talk.Run(Poll(query), wire).readings) {
      const std::string text = ToText(reading.value) + " " + Name(reading.quality);
      std::string& before = said[device.points.at(reading.point).name];
      if (!before.empty() && before != text) before += ", ";
      if (!before.ends_with(text)) before += text;
    }
  }
  return said;
}

struct SelectRow {
  const char* what;
  std::string telegrams;
  std::string val;
  std::string points;
  std::map<std::string, std::string> values;
};

TEST(TelegramQuestions, AValueBelongsToItsSelectedChannel) {
  const std::string alone = "  - { name: own, read: val.v, type: float32 }\n";
  const SelectRow rows[] = {
      {"two channels",
       kSel,
       kVal + ", before: sel",
       kBoth,
       {{"one", "10 good"}, {"two", "20 good"}}},
      {"answered",
       kAnsweredSel,
       kVal + ", before: sel",
       kBoth,
       {{"one", "10 good"}, {"two", "20 good"}}},
      {"a parameter of the device",
       kSel,
       kVal + ", before: sel",
       alone + "  - { name: two, read: val(n=2).v, type: float32 }\n",
       {{"own", "10 good"}, {"two", "20 good"}}},
      {"two selections",
       kSel + kRange,
       kVal + ", before: [ sel, range ]",
       "  - { name: a, read: 'val(n=1,r=1).v', type: float32 }\n"
       "  - { name: b, read: 'val(n=1,r=2).v', type: float32 }\n"
       "  - { name: c, read: 'val(n=2,r=1).v', type: float32 }\n"
       "  - { name: d, read: 'val(r=2,n=2).v', type: float32 }\n",
       {{"a", "10 good"}, {"b", "20 good"}, {"c", "20 good"}, {"d", "40 good"}}},
      {"other groups",
       kSel,
       kVal + ", before: sel",
       "  - { name: one, read: val(n=1).v, type: float32, group: slow }\n"
       "  - { name: two, read: val(n=2).v, type: float32 }\n"
       "  - { name: again, read: val(n=1).v, type: float32 }\n",
       {{"one", "10 good"}, {"two", "20 good"}, {"again", "10 good"}}},
  };
  for (const SelectRow& row : rows) {
    const bool ranges = row.telegrams.find("RNG") != std::string::npos;
    const config::Device device =
        Described(Selecting(row.telegrams, row.val, row.points, ranges ? "n: 1, r: 1" : "n: 1"));
    Selectable meter;
    meter.answers = row.telegrams == kAnsweredSel;
    EXPECT_EQ(Readings(device, [&](View request) { return meter(request); }), row.values)
        << row.what;
  }
}

TEST(TelegramQuestions, AFailedSelectionGivesNoValue) {
  const config::Device device = Described(Selecting(kAnsweredSel, kVal + ", before: sel", kBoth));
  for (const char* refusal : {"", "NO\r", "OK E\r", "??\r"}) {
    Selectable meter;
    meter.answers = true;
    const auto said = Readings(device, [&](View request) {
      if (AsText(request) == "CH2\r") return ToBytes(refusal);
      return meter(request);
    });
    EXPECT_EQ(said.at("one"), "10 good") << refusal;
    const auto two = said.find("two");
    const std::string shown = two == said.end() ? "" : two->second;
    EXPECT_EQ(shown.find("good"), std::string::npos) << refusal << ": " << shown;
  }
}

TEST(TelegramQuestions, ATelegramWithoutItsSelectionGivesNoValue) {
  const config::Device device = Described(Selecting(kSel, kVal + ", before: sel", kBoth));
  EXPECT_EQ(Said(device, AnswerTo(TelegramProtocol(), device, ToBytes("READ\r"), ToBytes("=+5\r"))),
            "");
  const config::Device plain = Described(
      Selecting(kSel, kVal + ", before: sel", "  - { name: own, read: val.v, type: float32 }\n"));
  EXPECT_EQ(Said(plain, AnswerTo(TelegramProtocol(), plain, ToBytes("READ\r"), ToBytes("=+5\r"))),
            "own 5 good")
      << "nothing tells it from another";
}

TEST(TelegramQuestions, AReplyMustRepeatTheSelectedChannel) {
  const config::Device device =
      Described("device: d\ntelegrams:\n" + kSel +
                "  val: { send: 'READ\\r', receive: '{n:d}={v:+decimal}\\r', reads: yes, before: "
                "sel, example: { "
                "send: 'READ\\r', receive: '1=+5\\r', v: 5 } }\npoints:\n" +
                kBoth);
  Talk talk(TelegramProtocol(), device);
  const auto said = [&](const char* reply) {
    return Said(device, talk.Run(Poll(1), [&](View request) {
      return AsText(request) == "READ\r" ? ToBytes(reply) : Bytes();
    }));
  };
  EXPECT_EQ(said("2=+20\r"), "two 20 good");
  EXPECT_EQ(said("1=+10\r").find("good"), std::string::npos);
}

TEST(TelegramQuestions, ARetryBeginsWithTheSelection) {
  const config::Device device = Described(Selecting(kAnsweredSel, kVal + ", before: sel", kBoth));
  Talk talk(TelegramProtocol(), device);
  ASSERT_TRUE(talk.Ask(Poll(1)));
  EXPECT_TRUE(talk.request().context.empty());
  talk.Reply(Poll(1), ToBytes("OK\r"));
  ASSERT_TRUE(talk.Ask(Poll(1)));
  const Request read = talk.request();
  EXPECT_EQ(AsText(read.context), "CH2\r");
  const auto again = talk->Instead(read, Outcome::no_reply, {});
  ASSERT_TRUE(again);
  EXPECT_EQ(AsText(again->bytes), "CH2\r");
  EXPECT_EQ(talk->OnFrame(Poll(1), *again, ToBytes("OK\r"), {}).then, Then::ask_again);
  ASSERT_TRUE(talk.Ask(Poll(1)));
  EXPECT_EQ(AsText(talk.request().bytes), "READ\r");
  EXPECT_FALSE(talk->Instead(talk.request(), Outcome::no_reply, {})) << "once";
  EXPECT_TRUE(talk->Instead(talk.request(), Outcome::unexpected, {})) << "its own may follow";
}

TEST(TelegramQuestions, ATelegramSentOnceRefusesParametersOfPoints) {
  const std::string once =
      "  sel: { send: 'CH{n:d}\\r', reads: yes, once: yes, example: { send: 'CH1\\r' } }\n";
  const config::LoadedProfile loaded = LoadText(Selecting(once, kVal + ", before: sel", kBoth));
  ASSERT_FALSE(loaded.problems.empty());
  EXPECT_NE(ToString(loaded.problems[0]).find("only once"), std::string::npos)
      << ToString(loaded.problems[0]);
  EXPECT_FALSE(LoadText(Selecting(kSel, kVal + ", before: sel",
                                  "  - { name: x, read: val(m=1).v, type: float32 }\n"))
                   .ok())
      << "no telegram has it";
}

TEST(TelegramQuestions, ATwinRemembersTheSelection) {
  const config::Device device = Described(Selecting(
      kAnsweredSel + "  set: { send: 'SET{value:.1decimal}\\r', receive: 'DONE\\r', before: sel, "
                     "example: { send: 'SET5.0\\r', receive: 'DONE\\r' } }\n",
      kVal + ", before: sel",
      "  - { name: one, read: val(n=1).v, write: set(n=1), access: rw, type: float32, min: 0, max: "
      "99 }\n"
      "  - { name: two, read: val(n=2).v, write: set(n=2), access: rw, type: float32, min: 0, max: "
      "99 }\n"));
  FixedValues values;
  values.values[0] = 10.0;
  values.values[1] = 20.0;
  const auto twin = TelegramProtocol().make_twin(device, values);
  Talk talk(TelegramProtocol(), device);
  EXPECT_EQ(Said(device, talk.Run(Poll(0), *twin)), "one 10 good");
  EXPECT_EQ(Said(device, talk.Run(Poll(1), *twin)), "two 20 good");
  EXPECT_EQ(talk.Run(Write(1, 33.0), *twin).outcome, Outcome::ok);
  EXPECT_EQ(Said(device, talk.Run(Poll(0), *twin)), "one 10 good");
  EXPECT_EQ(Said(device, talk.Run(Poll(1), *twin)), "two 33 good");
}

}  // namespace
}  // namespace baudgate::protocols::telegram
