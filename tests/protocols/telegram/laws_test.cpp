// Tests that the frame rules for telegrams of the shipped profiles and of other descriptions keep
// the laws in protocols/frame_rule.h.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/description.h"
#include "protocols/telegram/rules.h"
#include "tests/laws/frame_rule_laws.h"
#include "tests/protocols/telegram/support.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr char kBinary[] = R"(
device: d
telegrams:
  sized:
    send: 'hex 10 {address:uint8} 01'
    receive: 'hex 68 {:1bytes} {address:uint8} {level:int16_le} {:bytes} {checksum:uint16_le}'
    size_at: 1
    checksum: crc16_modbus
    reads: yes
    example: { send: 'hex 10 01 01', receive: 'hex 68 09 01 10 27 AA BB 45 87', level: 10000 }
  fixed:
    send: 'hex 10 {address:uint8} 02'
    receive: 'hex 05 {address:uint8} {total:bcd3} {flags:uint8} {checksum:uint32_be}'
    checksum: { kind: crc32, skip: 1 }
    reads: yes
    example: { send: 'hex 10 01 02', receive: 'hex 05 01 12 34 56 81 54 6E 45 91', total: 123456 }
points: []
)";

constexpr char kSparse[] = R"(
device: d
telegrams:
  bare:
    send: 'B'
    size: 4
    fields: { a: { at: 0, format: uint16_be }, b: { at: 2, format: uint16_be } }
    refused: '\x15'
    reads: yes
    example: { send: 'B', receive: 'hex 20 01 30 02', a: 8193, b: 12290 }
  short:
    send: 'A'
    receive: '\x06'
    refused: '\x15'
    example: { send: 'A', receive: '\x06' }
  twice:
    send: 'T'
    receive: '>{v:3d};{v:3d}\r'
    reads: yes
    example: { send: 'T', receive: '>123;123\r', v: 123 }
  mixed:
    send: 'M'
    receive: '\x02{v:decimal}\x03{checksum:03d}'
    refused: '\x04'
    checksum: { kind: sum8, skip: 1 }
    reads: yes
    example: { send: 'M', receive: '\x0212.5\x03201', v: 12.5 }
points: []
)";

/// Returns noise, and parts of the profile's texts without the characters that end a telegram.
Bytes Noise(std::mt19937& random) {
  constexpr std::string_view kText = "0123456789.+- SDIgW$,*>#\x02\x80";
  Bytes bytes(random() % 40);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(kText[random() % kText.size()]);
  return bytes;
}

/// Returns a function that returns the contents of a frame's fields. Laws compare these contents
/// instead of the bytes, because the hex digits of a check value can be upper or lower case.
std::function<Bytes(View)> EssenceOf(const Expectation& expect) {
  const auto awaited = std::static_pointer_cast<const Awaited>(expect.forms);
  return [awaited](View frame) {
    for (const Form* form : awaited->forms) {
      const Match match = MatchAll(*form, frame, awaited->known);
      if (match.kind != Match::Kind::whole) continue;
      std::string text;
      for (const auto& [name, value] : ValuesOf(*form, match)) text += name + ToText(value) + ";";
      return ToBytes(text);
    }
    return Bytes();
  };
}

bool HasChecksum(const Expectation& expect) {
  const auto awaited = std::static_pointer_cast<const Awaited>(expect.forms);
  return std::ranges::all_of(awaited->forms,
                             [](const Form* form) { return form->checksum.kind != nullptr; });
}

bool IsMarked(const Expectation& expect) {
  const auto awaited = std::static_pointer_cast<const Awaited>(expect.forms);
  return std::ranges::none_of(awaited->forms, &Form::is_unmarked);
}

void AddSubjects(const std::string& name, const config::Device& device,
                 std::vector<LawSubject>& subjects) {
  const auto description = DescriptionOf(device.options);
  const auto add = [&](const std::string& what, Expectation expect, std::vector<Bytes> frames) {
    LawSubject subject;
    subject.name = name + what;
    subject.rule = CutTelegram;
    subject.expect = std::move(expect);
    subject.frames = std::move(frames);
    subject.garbage = Noise;
    subject.checksum = HasChecksum(subject.expect);
    subject.found_behind_garbage = IsMarked(subject.expect);
    if (subject.checksum) subject.essence = EssenceOf(subject.expect);
    subjects.push_back(std::move(subject));
  };
  std::vector<Bytes> sent;
  std::vector<Bytes> unasked;
  for (const Telegram& telegram : description->telegrams) {
    const Example& example = telegram.examples.front();
    if (telegram.listen) unasked.push_back(example.receive);
    if (!telegram.send) continue;
    sent.push_back(example.send);
    if (telegram.receive.empty()) continue;
    std::string what = telegram.name;
    std::erase(what, '_');
    add("To" + what, Expect(example.send, ReadSettings(device.options)), {example.receive});
  }
  if (!sent.empty()) add("Requests", Expect({}, ReadSettings(device.options)), sent);
  if (!unasked.empty()) add("Unasked", ExpectUnasked(ReadSettings(device.options)), unasked);
}

std::vector<LawSubject> Subjects() {
  std::vector<LawSubject> subjects;
  AddSubjects("Sics", ShippedDevice(TelegramProtocol(), "mt-sics"), subjects);
  AddSubjects("Nmea", ShippedDevice(TelegramProtocol(), "nmea-0183-weather"), subjects);
  AddSubjects("Scpi", ShippedDevice(TelegramProtocol(), "scpi-instrument"), subjects);
  AddSubjects("Lauda", ShippedDevice(TelegramProtocol(), "lauda-thermostat"), subjects);
  AddSubjects("Mv110", ShippedDevice(TelegramProtocol(), "owen-mv110-8a-telegrams"), subjects);
  AddSubjects("Binary", Described(kBinary), subjects);
  AddSubjects("Sparse", Described(kSparse), subjects);
  return subjects;
}

using ::testing::ValuesIn;
INSTANTIATE_TEST_SUITE_P(Telegram, FrameRuleLaws, ValuesIn(Subjects()), LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Telegram, ChecksumLaws, ValuesIn(WithChecksum(Subjects())),
                         LawSubjectName);
INSTANTIATE_TEST_SUITE_P(Telegram, GarbageLaws, ValuesIn(FoundBehindGarbage(Subjects())),
                         LawSubjectName);

}  // namespace
}  // namespace baudgate::protocols::telegram
