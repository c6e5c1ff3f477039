// Fuzzes telegram descriptions: the frame rule keeps the laws in protocols/frame_rule.h, and a
// decoded number is always valid. Input: flags; up to four patterns, each behind a length byte;
// then pieces, each behind a length byte. A length with 0x80 stands for a telegram of the first
// pattern in place of a piece.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>

#include "protocols/assembler.h"
#include "protocols/telegram/points.h"
#include "protocols/telegram/rules.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using namespace protocols::telegram;  // NOLINT

constexpr std::size_t kMostBytes = 128;

protocols::Cut Checked(View held, const protocols::Expectation& expect, bool idle) {
  const protocols::Cut cut = CutTelegram(held, expect, idle);
  Require(cut.size <= held.size(), "a cut is no longer than what is held");
  if (cut.kind == protocols::Cut::Kind::need_more) return cut;
  Require(cut.size >= 1, "every answer but need_more consumes");
  if (cut.kind == protocols::Cut::Kind::frame) {
    Require(cut.size <= expect.max_bytes, "a frame is no longer than max_bytes");
  } else {
    Require(!cut.why.empty(), "a discard says why");
  }
  return cut;
}

struct Delivered {
  std::vector<Bytes> frames;
  std::uint64_t discarded = 0;
  Outcome blame = Outcome::none;
  bool operator==(const Delivered&) const = default;
};

Delivered Deliver(View stream, const std::vector<std::size_t>& cuts,
                  const protocols::Expectation& expect) {
  Delivered delivered;
  protocols::Assembler assembler;
  assembler.Begin(Checked, expect);
  std::size_t from = 0;
  const auto take = [&](std::size_t to, bool idle) {
    assembler.Feed(stream.subspan(from, to - from));
    from = to;
    while (auto frame = assembler.Next(idle)) delivered.frames.push_back(std::move(*frame));
    Require(assembler.held() <= expect.max_bytes, "memory is bounded by max_bytes");
  };
  for (const std::size_t cut : cuts) take(cut, false);
  take(stream.size(), false);
  take(stream.size(), true);
  Require(assembler.held() == 0, "nothing is held after silence");
  delivered.discarded = assembler.counters().discarded;
  delivered.blame = assembler.blame();
  return delivered;
}

Form FormOf(View text, std::uint8_t flags) {
  ParsedPattern parsed = ParsePattern(AsText(text));
  Require(parsed.pattern.has_value() != parsed.error.has_value(), "a pattern is one, or an error");
  if (parsed.error) {
    Require(!parsed.error->message.empty() && parsed.error->at <= text.size(),
            "an error has words and a place");
    return {};
  }
  Form form{std::move(*parsed.pattern), {}, {}};
  if (form.pattern.Has(kChecksum))
    form.checksum.kind = &ChecksumKinds()[flags % ChecksumKinds().size()];
  form.is_answer = (flags & 8U) != 0;
  form.checksum.skip = flags >> 4U & 1U;
  form.checksum.leave = flags >> 5U & 1U;
  const std::size_t at = flags & 3U;
  if ((flags & 0x40U) != 0 && at < form.pattern.least_size()) {
    form.size_at = SizeField{at, *ParseFormat("uint8"), 0};
  }
  return form;
}

void CheckNumbers(const Telegram& telegram, View frame) {
  const Reply reply = DecodeReply(telegram, frame, {});
  Require(reply.outcome == Outcome::ok || !reply.reason.empty(), "what is not ok has a reason");
  Require(reply.outcome == Outcome::ok || reply.fields.empty(), "what does not fit says nothing");
  for (const auto& [name, field] : reply.fields) {
    if (!IsGood(field.decoded.quality)) continue;
    Require(HasValue(field.decoded.value), "what is good has a value");
    if (const auto* number = std::get_if<double>(&field.decoded.value)) {
      Require(std::isfinite(*number), "NaN is never good");
    }
    const Element* element = telegram.FindField(name);
    Require(element != nullptr, "a value has a field");
    const bool plain = element->format.is_text_number() &&
                       element->format.kind != Format::Kind::hex &&
                       element->format.kind != Format::Kind::scientific;
    if (plain) {
      Require(field.text.find_first_not_of("+- 0123456789.") == std::string::npos,
              "a good number is made of digits");
    }
  }
}

void FuzzTelegram(View bytes) {
  Input input(bytes);
  Telegram telegram;
  telegram.name = "t";
  const std::size_t count = 1 + input.Below(4);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t flags = input.U8();
    Form form = FormOf(input.TakeCounted(), flags);
    if (!form.pattern.elements.empty()) telegram.receive.push_back(std::move(form));
  }
  if (telegram.receive.empty()) return;
  Bound values;
  for (const Element& element : telegram.receive.front().pattern.elements) {
    if (element.is_field()) values.emplace(element.name, std::int64_t{input.U8()});
  }
  const auto built = Build(telegram.receive.front(), values);
  Require(built || !built.error().empty(), "what cannot be built has a reason");

  Bytes stream;
  std::vector<std::size_t> cuts;
  while (!input.empty()) {
    const std::uint8_t head = input.U8();
    Append(stream, input.Take(head & 0x1FU));
    if ((head & 0x80U) != 0 && built) Append(stream, *built);
    if ((head & 0x40U) != 0) cuts.push_back(stream.size());
  }
  protocols::Expectation expect;
  expect.max_bytes = kMostBytes;
  auto awaited = std::make_shared<Awaited>();
  for (const Form& form : telegram.receive) awaited->forms.push_back(&form);
  expect.forms = awaited;
  const Delivered pieces = Deliver(stream, cuts, expect);
  if (!cuts.empty()) {
    Require(pieces == Deliver(stream, {}, expect), "any fragmentation gives the same");
  }
  for (const Bytes& frame : pieces.frames) CheckNumbers(telegram, frame);
}

const Registered kTelegram("telegram", FuzzTelegram);

}  // namespace
}  // namespace baudgate::fuzz
