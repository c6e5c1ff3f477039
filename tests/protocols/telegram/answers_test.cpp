// Tests which texts are accepted as answers, and the answers of simulated devices.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <fstream>
#include <iterator>
#include <tuple>

#include "gateway/diagnosis/damage/examine.h"
#include "tests/protocols/telegram/support.h"

namespace baudgate::protocols::telegram {
namespace {

/// A protocol like EI-Bisync of Eurotherm: two letters name the parameter, one byte confirms or
/// refuses.
constexpr char kBisync[] = R"(
device: controller
parameters: { g: "1", u: "2" }
telegrams:
  value:
    send: '\x04{g:1d}{g:1d}{u:1d}{u:1d}{name:2text}\x05'
    receive: '\x02{name:2text}{value:decimal}\x03{checksum:uint8}'
    refused: '\x04'
    checksum: { kind: xor8, skip: 1 }
    reads: yes
    example:
      - { send: '\x041122PV\x05', receive: '\x02PV10.5\x03\x1F', value: 10.5 }
      - { send: '\x041122SL\x05', receive: '\x02SL7\x03\x2B', value: 7 }
  status:
    send: '\x04{g:1d}{g:1d}{u:1d}{u:1d}SO\x05'
    receive: '\x02SO{flags:04X}\x03{checksum:uint8}'
    refused: '\x04'
    checksum: { kind: xor8, skip: 1 }
    reads: yes
    example: { send: '\x041122SO\x05', receive: '\x02SO0001\x03\x1E', flags: 1 }
  set:
    send: '\x04{g:1d}{g:1d}{u:1d}{u:1d}\x02SL{value:.1decimal}\x03{checksum:uint8}'
    checksum: { kind: xor8, skip: 6 }
    receive: '\x06'
    refused: '\x15'
    example: { send: '\x041122\x02SL7.0\x03\x35', receive: '\x06' }
points:
  - { name: pv, read: value(name=PV).value, type: float32 }
  - { name: sl, read: value(name=SL).value, write: set, access: rw, type: float32, min: 0, max: 100 }
  - { name: sl_again, read: value(name=SL).value, type: float32 }
  - { name: alarm, read: 'status.flags[b0]', type: bool }
)";

Outcome OutcomeOfAnswer(const config::Device& device, const std::string& request,
                        const std::string& answer) {
  return AnswerTo(TelegramProtocol(), device, ToBytes(request), ToBytes(answer)).outcome;
}

TEST(TelegramAnswers, AByteOfADamagedTelegramConfirmsAndRefusesNothing) {
  const config::Device device = Described(kBisync);
  const std::string write =
      "\x04"
      "1122\x02SL7.0\x03\x35";
  const std::string read =
      "\x04"
      "1122PV\x05";
  const std::string good = "\x02PV10.5\x03\x1F";
  EXPECT_EQ(OutcomeOfAnswer(device, write, "\x06"), Outcome::ok);
  EXPECT_EQ(OutcomeOfAnswer(device, write, "\xFF\x06"), Outcome::ok) << "the driver's noise";
  EXPECT_EQ(OutcomeOfAnswer(device, write, "\x15"), Outcome::refused);
  for (const char* wreck : {"\x02PV12\x03\x06", "\x02PV12\x03\x15", "x\x06", "PV\x06\x06"}) {
    EXPECT_FALSE(ProvesLife(OutcomeOfAnswer(device, write, wreck))) << wreck;
  }
  EXPECT_EQ(OutcomeOfAnswer(device, read, good), Outcome::ok);
  EXPECT_EQ(OutcomeOfAnswer(device, read, "\x04"), Outcome::unsupported);
  const std::string ends_so = "\x02PV10\x03\x04";
  for (std::size_t at = 0; at < ends_so.size() - 1; ++at) {
    for (const char damage : {'\0', '\x7F', ' '}) {
      std::string damaged = ends_so;
      damaged[at] = damage;
      const Outcome outcome = OutcomeOfAnswer(device, read, damaged);
      EXPECT_FALSE(ProvesLife(outcome)) << at << ": " << Printable(ToBytes(damaged));
    }
  }
}

constexpr char kBare[] = R"(
device: meter without a begin
telegrams:
  values:
    send: 'V'
    size: 4
    fields: { a: { at: 0, format: uint16_be }, b: { at: 2, format: uint16_be } }
    reads: yes
    example: { send: 'V', receive: 'hex 00 01 00 02', a: 1, b: 2 }
points:
  - { name: a, read: values.a, type: uint16 }
  - { name: b, read: values.b, type: uint16 }
)";

TEST(TelegramAnswers, ANoiseByteDoesNotShiftFieldsWithoutSeparators) {
  const config::Device device = Described(kBare);
  const auto said = [&](const char* bytes) {
    return Said(device, AnswerTo(TelegramProtocol(), device, ToBytes("V"), *ParseHex(bytes)));
  };
  EXPECT_EQ(said("00 01 00 02"), "a 1 good; b 2 good");
  EXPECT_EQ(said("FF 00 01 00 02"), "partial");
  EXPECT_EQ(said("00 01 00 02 FF"), "partial");
  EXPECT_EQ(said("00 01 00"), "partial");
}

TEST(TelegramAnswers, AStatusByteAppliesToAllValues) {
  const config::Device device = Described(R"(
device: sensor
telegrams:
  data:
    send: 'D'
    receive: 'hex 42 4D {level:uint16_be} {state:byte} {checksum:uint16_be}'
    checksum: sum16
    codes: { state: { '\x00': good, '0x01': uncertain } }
    reads: yes
    example:
      - { send: 'D', receive: 'hex 42 4D 00 07 00 00 96', level: 7, state: '0x00' }
      - { send: 'D', receive: 'hex 42 4D 00 07 01 00 97', level: uncertain }
      - { send: 'D', receive: 'hex 42 4D 00 07 02 00 98', level: bad }
points:
  - { name: level, read: data.level, type: uint16 }
  - { name: ok, read: data.state=0x00, type: bool }
)");
  const auto said = [&](const char* bytes) {
    return Said(device, AnswerTo(TelegramProtocol(), device, ToBytes("D"), *ParseHex(bytes)));
  };
  EXPECT_EQ(said("42 4D 00 07 00 00 96"), "level 7 good; ok true good");
  EXPECT_EQ(said("42 4D 00 07 01 00 97"), "level 7 uncertain; ok false good");
  EXPECT_EQ(said("42 4D 00 07 02 00 98"), "level bad; ok false good");
  const Answer unknown =
      AnswerTo(TelegramProtocol(), device, ToBytes("D"), *ParseHex("42 4D 00 07 02 00 98"));
  EXPECT_EQ(unknown.reason, "'state' contains '0x02', which is not in the codes of its profile");
  EXPECT_FALSE(unknown.remedy.empty()) << "status quotes it with that";
}

TEST(TelegramAnswers, ADecimalCommaIsReported) {
  const config::Device device = Described(R"(
device: scale
telegrams:
  weight:
    send: 'W\r'
    receive: '{value:+.scientific}\r'
    reads: yes
    example: { send: 'W\r', receive: '+1.25E+01\r', value: 12.5 }
points:
  - { name: weight, read: weight.value, type: float64 }
)");
  const ParsedOptions options = ParseOptions(TelegramProtocol(), device.options);
  const Bytes request = ToBytes("W\r");
  const Expectation expect = TelegramProtocol().expect(request, options);
  const Bytes heard = ToBytes("+1,25E+01\r");
  const Finding finding = diagnosis::Examine({.protocol = &TelegramProtocol(),
                                              .options = &options,
                                              .request = request,
                                              .expect = &expect,
                                              .outcome = Outcome::corrupt,
                                              .heard = heard});
  EXPECT_EQ(finding.cause, "a comma comes in place of a decimal point ('+1,25E+01\\r')");
}

TEST(TelegramAnswers, ARepeatedFieldMustHaveEqualValues) {
  const config::Device device = Described(kBisync);
  Talk talk(TelegramProtocol(), device);
  EXPECT_EQ(AsText(talk.Ask(Poll(0))->bytes),
            "\x04"
            "1122PV\x05");
  EXPECT_FALSE(ProvesLife(OutcomeOfAnswer(device,
                                          "\x04"
                                          "1222PV\x05",
                                          "\x02PV10.5\x03\x1F")))
      << "not a telegram of its profile";
}

TEST(TelegramAnswers, OfSimilarTelegramsTheLiteralOneMatches) {
  const config::Device device = Described(kBisync);
  EXPECT_EQ(Said(device, AnswerTo(TelegramProtocol(), device,
                                  ToBytes("\x04"
                                          "1122SO\x05"),
                                  ToBytes("\x02SO0001\x03\x1E"))),
            "alarm true good");
  std::string text = kBisync;
  text.replace(text.find("name=PV"), 7, "name=SO");
  Talk talk(TelegramProtocol(), Described(text));
  const auto request = talk.Ask(Poll(0));
  ASSERT_FALSE(request);
  EXPECT_NE(request.error().find("has the same bytes as telegram 'status'"), std::string::npos)
      << request.error();
}

TEST(TelegramWrites, AnInexpressibleValueIsNotSent) {
  Talk talk(TelegramProtocol(), Described(kBisync));
  EXPECT_TRUE(talk.Ask(Write(1, 24.5)));
  const auto refused = talk.Ask(Write(1, 24.96));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("24.96 has more decimals"), std::string::npos) << refused.error();
  EXPECT_EQ(talk.asked.size(), 1U);
}

TEST(TelegramTwin, AnswersEachParameterByItsExampleAndReturnsWrites) {
  const config::Device device = Described(kBisync);
  FixedValues values;
  const auto twin = TelegramProtocol().make_twin(device, values);
  EXPECT_EQ(AsText(twin->Answer(ToBytes("\x04"
                                        "1122SL\x05"),
                                {})),
            "\x02SL7\x03\x2B");
  EXPECT_EQ(AsText(twin->Answer(ToBytes("\x04"
                                        "1122PV\x05"),
                                {})),
            "\x02PV10.5\x03\x1F");
  values.values[1] = 7.0;
  values.values[2] = 7.0;
  Talk talk(TelegramProtocol(), device);
  EXPECT_EQ(talk.Run(Write(1, 24.5), *twin).outcome, Outcome::ok);
  EXPECT_EQ(ToDouble(values.values[1]), 24.5);
  EXPECT_EQ(ToDouble(values.values[2]), 24.5) << "another point of the same field";
  values.values[0] = 21.123456789012345;
  EXPECT_TRUE(AsText(twin->Answer(ToBytes("\x04"
                                          "1122PV\x05"),
                                  {}))
                  .starts_with("\x02PV21.123\x03"));
}

TEST(TelegramAnswers, AnInvalidNumberIsExplained) {
  const struct {
    std::string format;
    std::string came;
    std::string reason;
  } rows[] = {
      {"decimal", "12,50", "its numbers have a decimal comma ('12,50')"},
      {"+07.3f", "+012.50", "it sends 2 decimals, but 3 are described in its profile ('+012.50')"},
      {"+07.3f", "+12.500", ""},
      {"+07.3f", "+2.500", "it sends 6 characters, but 7 are described in its profile ('+2.500')"},
      {"decimal", "12.5 m", "'12.5 m' comes in the place of 'level', which must be a number"},
      {"decimal", "----", ""},
  };
  for (const auto& row : rows) {
    const config::Device device = Described(R"(
device: probe
telegrams:
  level:
    send: 'L\r'
    receive: 'L={level:)" + row.format + R"(};\r'
    reads: yes
    example: { send: 'L\r', receive: 'L=+12.500;\r', level: 12.5 }
points:
  - { name: level, read: level.level, type: float32 }
)");
    const Answer answer =
        AnswerTo(TelegramProtocol(), device, ToBytes("L\r"), ToBytes("L=" + row.came + ";\r"));
    EXPECT_EQ(answer.outcome, Outcome::ok) << row.came;
    EXPECT_EQ(answer.reason, row.reason) << row.came;
    EXPECT_EQ(answer.remedy.empty(), row.reason.empty()) << row.came;
  }
}

std::string Read(const config::Device& device, const std::string& request,
                 const std::string& answer) {
  return Said(device, AnswerTo(TelegramProtocol(), device, ToBytes(request), ToBytes(answer)));
}

TEST(TelegramCodes, EveryValueBeyondTheOverloadCodeIsAnOverload) {
  const config::Device device = ShippedDevice(TelegramProtocol(), "scpi-instrument");
  const std::pair<const char*, const char*> kRows[] = {
      {"+9.90000000E+37", "bad: sensor failure, over range"},
      {"+9.99999999E+37", "bad: sensor failure, over range"},
      {"+1.00000000E+38", "bad: sensor failure, over range"},
      {"+9.91000001E+37", "bad: sensor failure, over range"},
      {"-9.90000000E+37", "bad: sensor failure, under range"},
      {"-9.91000000E+37", "bad: sensor failure, under range"},
      {"-1.0E+38", "bad: sensor failure, under range"},
      {"+9.91000000E+37", "bad"},
      {"+9.91E37", "bad: sensor failure"},
      {"+9.89999999E+37", "98999999000000000000000000000000000000 good"},
      {"+1.25000000", "bad: sensor failure"},
  };
  for (const auto& [answer, said] : kRows) {
    const std::string value = Read(device, "READ?\n", answer + std::string("\r\n"));
    if (std::string(said).ends_with("good")) {
      EXPECT_TRUE(value.ends_with(" good")) << value;
    } else {
      EXPECT_EQ(value, std::string("reading ") + said) << answer;
    }
  }
}

config::LoadedProfile WithCodes(const std::string& format, const std::string& codes) {
  const bool text = format.find('_') == std::string::npos;
  return LoadText(std::string("device: d\ntelegrams:\n  a:\n    send: 'A'\n    receive: '") +
                  (text ? "=" : "hex 3D ") + "{v:" + format + "}" + (text ? ";" : " 3B") +
                  "'\n    reads: yes\n    codes: { v: { " + codes +
                  " } }\n    example: { send: 'A', " + "receive: " +
                  (format == "float32_be" ? "'hex 3D 3F 80 00 00 3B'"
                   : format == "int16_be" ? "'hex 3D 00 01 3B'"
                                          : "'=1;'") +
                  ", v: 1 }\npoints: [ { name: v, read: a.v, type: float64 } ]\n");
}

/// "123 " can be a damaged "1234", unless an example is aligned to the left.
TEST(TelegramAnswers, BlanksBehindANumberNeedAnExample) {
  const std::tuple<const char*, const char*, const char*> kRows[] = {
      {"1234", "123 ", "v bad: sensor failure"}, {"1234", " 123", "v 123 good"},
      {" 123", "123 ", "v bad: sensor failure"}, {"123 ", "12  ", "v 12 good"},
      {"123 ", "1234", "v 1234 good"},           {"123 ", "12. ", "v bad: sensor failure"}};
  for (const auto& [example, came, said] : kRows) {
    const config::Device device = Described(
        std::string(
            "device: d\ntelegrams:\n  a: { send: 'A', receive: '={v:4decimal};', reads: yes, "
            "example: { send: 'A', receive: '=") +
        example + ";' } }\npoints: [ { name: v, read: a.v, type: float32 } ]\n");
    EXPECT_EQ(Read(device, "A", "=" + std::string(came) + ";"), said) << example;
  }
}

TEST(TelegramCodes, ACodeMayBeARangeOfNumbers) {
  const struct {
    const char* format;
    const char* codes;
    Bytes said;
    const char* means;
  } rows[] = {
      {"decimal", "'900..': over", ToBytes("900"), "v bad: sensor failure, over range"},
      {"decimal", "'900..': over", ToBytes("899.9"), "v 899.9 good"},
      {"decimal", "'900..': over, '999.9': open", ToBytes("999.9"),
       "v bad: sensor failure, open sensor"},
      {"decimal", "'900..999': over", ToBytes("999"), "v bad: sensor failure, over range"},
      {"decimal", "'900..999': over", ToBytes("999.1"), "v 999.1 good"},
      {"decimal", "'..-0.5': under", ToBytes("-0.5"), "v bad: sensor failure, under range"},
      {"decimal", "'.....': over", ToBytes("....."), "v bad: sensor failure, over range"},
      {"decimal", "'0..10': good", ToBytes("5x"), "v bad: sensor failure"},
      {"int16_be", "'0x7FF0..0x7FFF': over", *ParseHex("7F F3"),
       "v bad: sensor failure, over range"},
      {"int16_be", "'..-32760': under", *ParseHex("80 00"), "v bad: sensor failure, under range"},
      {"float32_be", "'999.9': over", *ParseHex("44 79 F9 9A"),
       "v bad: sensor failure, over range"},
      {"float32_be", "'-99.9': under", *ParseHex("C2 C7 CC CD"),
       "v bad: sensor failure, under range"},
      {"float32_be", "'1e30': over", *ParseHex("71 49 F2 CA"), "v bad: sensor failure, over range"},
      {"float32_be", "'999.9..': over", *ParseHex("44 79 F9 9A"),
       "v bad: sensor failure, over range"},
      {"float32_be", "'..0.1': under", *ParseHex("3D CC CC CD"),
       "v bad: sensor failure, under range"},
  };
  for (const auto& row : rows) {
    const config::LoadedProfile loaded = WithCodes(row.format, row.codes);
    for (const auto& problem : loaded.problems) ADD_FAILURE() << row.codes << ToString(problem);
    if (!loaded.ok()) continue;
    const config::Device device =
        config::DeviceFromProfile(loaded.profile, TelegramProtocol(), "device", "1");
    Bytes answer = {'='};
    Append(answer, row.said);
    answer.push_back(std::string(row.format).find('_') == std::string::npos ? ';' : 0x3B);
    EXPECT_EQ(Said(device, AnswerTo(TelegramProtocol(), device, ToBytes("A"), answer)), row.means)
        << row.format << " " << row.codes;
  }
}

TEST(TelegramCodes, AnImpossibleCodeIsAnError) {
  const std::tuple<const char*, const char*, const char*> kRows[] = {
      {"decimal", "'999..900': over", "larger"},
      {"decimal", "'900..x': over", "is not a range"},
      {"int16_be", "'0x8000': over", "can never occur"},
      {"int16_be", "'OVL': over", "is not a number"},
      {"int16_be", "'1..x': over", "is not a range"},
  };
  for (const auto& [format, codes, says] : kRows) {
    std::string said;
    for (const auto& problem : WithCodes(format, codes).problems) said += ToString(problem);
    EXPECT_NE(said.find(says), std::string::npos) << codes << ": " << said;
  }
}

TEST(TelegramTwin, SendsTheCodeOfAnInvalidValue) {
  const config::Device device = ShippedDevice(TelegramProtocol(), "scpi-instrument");
  FixedValues values;
  const auto twin = TelegramProtocol().make_twin(device, values);
  for (const double beyond : {HUGE_VAL, -HUGE_VAL}) {
    values.values[0] = beyond;
    const Bytes said = twin->Answer(ToBytes("READ?\n"), {});
    EXPECT_EQ(Read(device, "READ?\n", std::string(AsText(said))),
              beyond > 0 ? "reading bad: sensor failure, over range"
                         : "reading bad: sensor failure, under range");
  }
}

std::string ProfileOfTheReadme() {
  std::ifstream file("protocols/telegram/README.md");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::size_t begin = text.find("```yaml\n") + 8;
  return text.substr(begin, text.find("```", begin) - begin);
}

TEST(TelegramUnits, TheBalanceOfTheReadmeAcceptsOnlyItsOwnUnit) {
  const config::Device device = Described(ProfileOfTheReadme());
  EXPECT_EQ(Read(device, "SI\r\n", "S S     100.00 g\r\n"), "weight 100 good; stable true good");
  for (const char* answer : {"S S    0.10000 kg\r\n", "S S     100.00 G\r\n",
                             "S S     3.5274 oz\r\n", "S S     100.00 mg\r\n"}) {
    EXPECT_EQ(Read(device, "SI\r\n", answer), "weight bad; stable true good") << answer;
  }
}

config::LoadedProfile WithReceive(const std::string& receive, const std::string& examples,
                                  const std::string& more = "") {
  return LoadText("device: d\ntelegrams:\n  w:\n    send: 'W\\r'\n    receive: '" + receive +
                  "\\r'\n    reads: yes\n" + more + "    example: [ " + examples +
                  " ]\npoints: [ { name: w, read: w.w, type: float32, unit: g } ]\n");
}

TEST(TelegramUnits, AUnitWithoutCodesMustMatchTheFirstExample) {
  const std::string first = "{ send: 'W\\r', receive: '12.5 g\\r', w: 12.5 }";
  const auto loaded = WithReceive("{w:decimal} {unit:word}", first);
  ASSERT_TRUE(loaded.ok());
  const config::Device device =
      config::DeviceFromProfile(loaded.profile, TelegramProtocol(), "device", "1");
  EXPECT_EQ(Read(device, "W\r", "12.5 g\r"), "w 12.5 good");
  EXPECT_EQ(Read(device, "W\r", "12.5 kg\r"), "w bad");
  const std::string second = first + ", { send: 'W\\r', receive: '12.5 kg\\r', w: 12.5 }";
  EXPECT_FALSE(WithReceive("{w:decimal} {unit:word}", second).ok()) << "in two units at once";
  EXPECT_TRUE(WithReceive("{w:decimal} {unit:word}", second,
                          "    codes: { unit: { 'g': good, 'kg': good } }\n")
                  .ok());
}

struct UnitRow {
  const char* receive;
  const char* came;
  const char* codes;  ///< `codes` for the field `unit`; empty: its unit is that of the example
  const char* point;  ///< options of the point behind its type
  bool wrong;
};

constexpr UnitRow kUnitRows[] = {
    {"{w:decimal} {unit:word}", "12.5 g", "", "unit: g", false},
    {"{w:decimal} {unit:word}", "12.5 g", "", "unit: kg", true},
    {"{w:decimal} {unit:word}", "12.5 g", "unit: { 'g': good }", "unit: kg", true},
    {"{w:decimal} {unit:word}", "12.5 g", "unit: { 'g': good }", "unit: ''", false},
    {"{w:decimal} {unit:word}", "12.5 g", "unit: { 'g': good }", "unit: kg, scale: 0.001", false},
    {"{w:decimal} {unit:word}", "12.5 C", "", "unit: K, offset: 273.15", false},
    {"{w:decimal} {unit:word}", "12.5 C", "", "unit: K", true},
    {"{w:decimal} {unit:word}", "12.5 C", "", "unit: '°C'", false},
    {"{w:decimal} {unit:word}", "12.5 KG", "", "unit: kg", false},
    {"{w:decimal} {unit:3text}", "12.5 g  ", "", "unit: 'g'", false},
    {"{w:decimal} {unit:word}", "12.5 MPa", "", "unit: mPa", true},
    {"{w:decimal} {unit:word}", "12.5 MBAR", "", "unit: mbar", false},
    {"{w:decimal} {unit:word}", "12.5 N", "", "unit: kn", false},
    {"{w:decimal} {unit:word}", "12.5 N", "", "unit: kN", true},
    {"{w:decimal} {unit:word}", "12.5 1", "", "unit: kg", false},  // a number in place of the unit
    {"{w:decimal} {unit:word}", "12.5 g", "unit: { 'g': good, 'kg': good }", "unit: kg", false},
    {"{w:decimal} {unit:word}", "12.5 g", "unit: { 'g': good, 'kg': good }", "unit: t", true},
    {"{w:decimal} {unit:word}", "12.5 g", "unit: { 'g': good, 'kg': bad }", "unit: kg", true},
    {"{w:decimal},{s:char},{unit:word}", "12.5,S,g", "s: { 'S': good }", "unit: kg", true},
    {"{w:decimal} {unit:word} {t:decimal} {t_unit:word}", "12.5 g 20.1 C", "", "unit: g", false},
    {"{w:decimal} {unit:word} {t:decimal} {t_unit:word}", "12.5 g 20.1 C", "", "unit: C", true},
    {"{t:decimal} {t_unit:word} {w:decimal}", "20.1 C 12.5", "", "unit: g", false},
    {"{unit:word} {w:decimal}", "g 12.5", "", "unit: kg", true},
};

/// The telegram contains its unit. If the point had another unit, 99 g would be shown as 99 kg.
TEST(TelegramUnits, APointMustHaveTheUnitOfItsTelegram) {
  for (const UnitRow& row : kUnitRows) {
    const std::string codes =
        *row.codes != 0 ? std::string("    codes: { ") + row.codes + " }\n" : "";
    const auto loaded = LoadText(
        std::string("device: d\ntelegrams:\n  w:\n    send: 'W\\r'\n    receive: '") + row.receive +
        "\\r'\n    reads: yes\n" + codes + "    example: { send: 'W\\r', receive: '" + row.came +
        "\\r', w: 12.5 }\npoints: [ { name: p, read: w.w, type: float32, " + row.point + " } ]\n");
    std::string said;
    for (const auto& problem : loaded.problems) said += config::ToString(problem) + "\n";
    EXPECT_EQ(!loaded.ok(), row.wrong) << row.receive << " " << row.point << "\n" << said;
    if (!row.wrong) continue;
    EXPECT_NE(said.find("point 'p' has unit '"), std::string::npos) << said;
    EXPECT_NE(said.find("of telegram 'w' is '"), std::string::npos) << said;
  }
}

TEST(TelegramUnits, AnOverriddenUnitOfADeviceIsReported) {
  const auto faults = [](const char* profile, const char* point, const char* unit,
                         const config::Pairs& parameters) {
    config::Device device = ShippedDevice(TelegramProtocol(), profile);
    std::ranges::find(device.points, point, &config::Point::name)->unit = unit;
    if (!parameters.empty()) device.options.Set("parameters", parameters);
    return TelegramProtocol().faults(device).size();
  };
  EXPECT_EQ(faults("mt-sics", "weight", "g", {}), 0U);
  EXPECT_EQ(faults("mt-sics", "weight", "kg", {}), 1U);
  EXPECT_EQ(faults("mt-sics", "tare_weight", "kg", {}), 1U);
  const char* const kWeather = "nmea-0183-weather";
  EXPECT_EQ(faults(kWeather, "wind_speed", "kn", {}), 0U);
  EXPECT_EQ(faults(kWeather, "wind_speed", "m/s", {}), 1U);
  EXPECT_EQ(faults(kWeather, "wind_speed", "m/s", {{"speed_unit", "M"}}), 0U);
  EXPECT_EQ(faults(kWeather, "wind_speed", "kn", {{"speed_unit", "M"}}), 1U);
}

TEST(TelegramUnits, AnUncheckedTextNextToANumberIsWarnedAbout) {
  const std::tuple<const char*, const char*, const char*, bool> kRows[] = {
      {"{w:decimal} {u:word}", "12.5 g", "", true},
      {"{w:6decimal}{u:3text}", "  12.5 g ", "", true},
      {"{w:decimal},{u:word},{state:char}", "12.5,g,S", "", true},
      {"{w:decimal} {:word}", "12.5 g", "", true},
      {"{w:decimal}{:3text}", "12.5 g ", "", true},
      {"{w:decimal}{:3text}", "12.5   ", "", false},
      {"{state:char} {w:decimal} g", "S 12.5 g", "", true},
      {"{u:word} {w:decimal}", "g 12.5", "", true},
      {"{state:char} {w:decimal} g", "S 12.5 g", "    codes: { state: { 'S': good } }\n", false},
      {"{w:decimal} {unit:word}", "12.5 g", "", false},
      {"{w:decimal} g", "12.5 g", "", false},
      {"{head:2text}MWV,{w:decimal},R", "WIMWV,12.5,R", "", false},
      {"{w:decimal},{other:integer}", "12.5,3", "", false},
  };
  for (const auto& [receive, came, more, doubted] : kRows) {
    const auto loaded = WithReceive(
        receive, std::string("{ send: 'W\\r', receive: '") + came + "\\r', w: 12.5 }", more);
    for (const auto& problem : loaded.problems) ADD_FAILURE() << receive << ToString(problem);
    const config::Device device =
        config::DeviceFromProfile(loaded.profile, TelegramProtocol(), "device", "1");
    const auto doubts = TelegramProtocol().doubts(device);
    const bool said = std::ranges::any_of(doubts, [](const ConfigRemark& doubt) {
      return doubt.text.find("this text is not checked") != std::string::npos;
    });
    EXPECT_EQ(said, doubted) << receive << " " << came;
  }
  for (const char* name : {"mt-sics", "nmea-0183-weather", "scpi-instrument",
                           "owen-mv110-8a-telegrams", "lauda-thermostat"}) {
    EXPECT_TRUE(TelegramProtocol().doubts(ShippedDevice(TelegramProtocol(), name)).empty() ||
                std::string(name) == "lauda-thermostat")
        << name;
  }
}

}  // namespace
}  // namespace baudgate::protocols::telegram
