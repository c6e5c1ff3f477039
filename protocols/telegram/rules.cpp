// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/rules.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/common/settings.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {
namespace {

void AddForm(const Form& form, std::size_t most, Awaited& awaited, Expectation& expect) {
  const auto [least, longest] = form.pattern.usual_sizes();
  expect.shapes.push_back({static_cast<int>(awaited.forms.size()), least,
                           form.size_at ? most : longest.value_or(most)});
  awaited.forms.push_back(&form);
}

/// Adds the positions of the password in the request, and of the check value that is computed over
/// it.
void AddSecrets(const Form& form, const Match& match, Expectation& expect) {
  if (!form.pattern.Has(kPassword)) return;
  std::size_t at = 0;
  for (std::size_t i = 0; i < match.parts.size(); at += match.parts[i].size(), ++i) {
    const Element& element = form.pattern.elements[i];
    if (!element.is_field() || match.parts[i].empty()) continue;
    if (element.name == kPassword || element.name == kChecksum) {
      expect.secrets.emplace_back(at, match.parts[i].size());
    }
  }
}

/// Returns the bytes of the address in answers. Empty: answers have no address, or their forms
/// write it differently.
Bytes AddressIn(const Telegram& telegram, const Bound& known) {
  const auto address = known.find(kAddress);
  if (address == known.end() || telegram.receive.empty()) return {};
  Bytes bytes;
  for (const Form& form : telegram.receive) {
    const Element* element = form.pattern.Find(kAddress);
    const auto field =
        element != nullptr ? EncodeField(element->format, address->second) : Result<Bytes>(Bytes());
    if (!field || field->empty() || (!bytes.empty() && bytes != *field)) return {};
    bytes = *field;
  }
  return bytes;
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  Expectation expect;
  auto awaited = std::make_shared<Awaited>();
  awaited->description = settings.description;
  if (!awaited->description) return expect;
  const Description& description = *awaited->description;
  expect.max_bytes = description.most;
  if (request.empty()) {
    for (const Telegram& telegram : description.telegrams) {
      if (telegram.send) AddForm(*telegram.send, description.most, *awaited, expect);
    }
    expect.forms = std::move(awaited);
    return expect;
  }
  const auto sent = description.Recognise(request);
  if (!sent) {
    expect.repeatable = false;
    return expect;
  }
  const Telegram& telegram = description.telegrams[sent->telegram];
  for (const auto* forms : {&telegram.receive, &telegram.refused}) {
    for (const Form& form : *forms) AddForm(form, description.most, *awaited, expect);
  }
  awaited->known = sent->values;
  expect.repeatable = telegram.may_repeat();
  if (telegram.receive.empty()) expect.reply = Expectation::Reply::none;
  expect.address = AddressIn(telegram, sent->values);
  AddSecrets(*telegram.send, sent->match, expect);
  expect.mirrors = std::ranges::any_of(telegram.receive, [&](const Form& form) {
    return MatchAll(form, request, sent->values).kind == Match::Kind::whole;
  });
  expect.forms = std::move(awaited);
  return expect;
}

Expectation ExpectUnasked(const Settings& settings) {
  Expectation expect;
  expect.reply = Expectation::Reply::standing;
  auto awaited = std::make_shared<Awaited>();
  awaited->description = settings.description;
  if (!awaited->description) return expect;
  expect.max_bytes = awaited->description->most;
  awaited->known = BoundOf(settings, {});
  for (const Telegram& telegram : awaited->description->telegrams) {
    if (!telegram.listen) continue;
    for (const Form& form : telegram.receive) {
      AddForm(form, awaited->description->most, *awaited, expect);
    }
  }
  expect.forms = std::move(awaited);
  return expect;
}

// CutTelegram tries the possible forms at the first byte, in the order of the description. If none
// begins there, one byte is dropped, so that a good telegram behind a damaged one is found.
//
//   receive: 'S {state:char} {weight:10decimal} {unit:word}\r\n'
//   < 53 20 53 20 20 20 20 20 31 30 30 2E 30 30 20 67 0D 0A    "S S     100.00 g": whole
//   < 53 20 53 20 20 20 FF 20                                  a text field has no such byte
//
// An unmarked telegram begins with a field and has no check value, so it could be found inside a
// damaged one: "-03" in "1.25E-03" whose sign was lost. If such a telegram is possible, the whole
// line is dropped, or all bytes up to the next silence if no fixed characters end the telegram. For
// an answer of one or two fixed bytes, such as an ACK, all bytes up to the next silence are
// dropped, too. A telegram that ends with a field is whole when the line is silent: if more bytes
// follow without a pause, its bytes are shifted.

namespace {

bool AllHarmless(View bytes) {
  return std::ranges::all_of(bytes,
                             [](std::uint8_t byte) { return cut::IsHarmless(byte, "\r\n"); });
}

/// Returns the position behind the first characters that end one of the unmarked forms. Empty:
/// these characters have not come.
std::optional<std::size_t> EndOfLine(View held, const Awaited& awaited) {
  std::optional<std::size_t> first;
  for (const Form* form : awaited.forms) {
    if (!form->is_unmarked()) continue;
    const Bytes& end = form->pattern.elements.back().literal;
    const auto found = std::search(held.begin(), held.end(), end.begin(), end.end());
    if (found == held.end()) continue;
    const auto behind = static_cast<std::size_t>(found - held.begin()) + end.size();
    first = std::min(first.value_or(behind), behind);
  }
  return first;
}

/// Drops bytes at whose front no telegram begins, up to the end of their line or the next silence,
/// without looking for a telegram among them.
Cut DropLine(View held, const Awaited& awaited, std::size_t most, bool idle) {
  const bool has_lines = std::ranges::none_of(awaited.forms, [](const Form* form) {
    return form->is_scant() || (form->is_unmarked() && form->pattern.elements.back().is_field());
  });
  // Only the first `most` bytes are examined, so that the result does not depend on how the bytes
  // were split: if they came one by one, there would never be more.
  const View near = held.first(std::min(held.size(), most));
  const auto end = has_lines ? EndOfLine(near, awaited) : std::nullopt;
  const auto drop = [&](std::size_t size, Outcome blame, std::string_view why) {
    return Cut::Discard(size, AllHarmless(held.first(size)) ? Outcome::none : blame, why);
  };
  if (end) return drop(*end, Outcome::corrupt, "not as described");
  // If lines come, only one byte is dropped. The rest is still longer than any unmarked telegram,
  // so the end of this line is not taken for a telegram.
  if (held.size() >= most) return drop(has_lines ? 1 : most, Outcome::corrupt, "too long");
  if (idle) return drop(held.size(), Outcome::partial, "stopped mid-frame");
  return Cut::NeedMore();
}

}  // namespace

Cut CutTelegram(View held, const Expectation& expect, bool idle) {
  const auto* awaited = static_cast<const Awaited*>(expect.forms.get());
  bool began = false;
  bool bad_checksum = false;
  bool unmarked = false;
  bool begins_fixed = true;
  std::size_t other = 0;
  if (awaited != nullptr) {
    for (const Form* form : awaited->forms) {
      const bool is_unmarked = form->is_unmarked();
      unmarked = unmarked || is_unmarked;
      begins_fixed = begins_fixed && !(is_unmarked && form->pattern.elements.front().is_field());
      const std::size_t most = is_unmarked ? expect.max_bytes / 2 : expect.max_bytes;
      const Match match = MatchFront(*form, held, idle, most, awaited->known);
      if (match.kind == Match::Kind::need_more) return Cut::NeedMore();
      if (match.kind == Match::Kind::whole) {
        if (form->ends_with_silence()) {
          if (held.size() > match.size) continue;
          if (!idle) return Cut::NeedMore();
        }
        if (!match.other) return Cut::Frame(match.size);
        if (other == 0) other = match.size;
      }
      began = began || match.began;
      bad_checksum = bad_checksum || match.bad_checksum;
    }
  }
  if (other != 0) return cut::OfAnother(other);
  if (unmarked) {
    // No telegram begins with a noise byte of a line driver if all forms begin with fixed bytes, so
    // this byte is dropped alone.
    if (begins_fixed && cut::IsHarmless(held[0], "\r\n"))
      return Cut::Discard(1, Outcome::none, "noise of a driver");
    return DropLine(held, *awaited, expect.max_bytes, idle);
  }
  if (bad_checksum) return cut::BadChecksum();
  if (began && !idle) return Cut::Discard(1, Outcome::corrupt, "not as described");
  return cut::Slide(
      held, began ? "stopped mid-frame" : "the bytes are not the beginning of an expected answer");
}

namespace {

/// Returns the typed bytes unchanged, because nothing can be completed in a described telegram.
Result<Bytes> Complete(View written, const Settings&) {
  if (written.empty()) return Error{"a telegram needs at least one byte, as in '53 0D 0A'"};
  return Bytes(written.begin(), written.end());
}

bool IsRead(View request, const Settings& settings) {
  const auto& description = settings.description;
  const auto sent = description ? description->Recognise(request) : std::nullopt;
  return sent && description->telegrams[sent->telegram].reads;
}

}  // namespace

const TelegramRule kAskRule = {.complete = kWithSettings<Complete>,
                               .is_read = kWithSettings<IsRead>};

namespace {

/// A check value as received, and the bytes in front of it.
struct Said {
  View front{};
  std::uint32_t value = 0;
};

std::optional<Said> SaidOf(const Form& form, const Match& match) {
  const auto& elements = form.pattern.elements;
  std::size_t at = 0;
  for (std::size_t i = 0; i < match.parts.size(); at += match.parts[i].size(), ++i) {
    if (!elements[i].is_field() || elements[i].name != kChecksum) continue;
    const Value value = DecodeField(elements[i].format, match.parts[i]);
    const auto* number = std::get_if<std::int64_t>(&value);
    if (number == nullptr || *number < 0) return std::nullopt;
    return Said{View(match.parts[0].data(), at), static_cast<std::uint32_t>(*number)};
  }
  return std::nullopt;
}

std::vector<std::pair<std::size_t, std::size_t>> RangesBeside(const Checksum& own) {
  std::vector<std::pair<std::size_t, std::size_t>> ranges = {{own.skip, own.leave}};
  for (const std::size_t skip : {own.skip, std::size_t{0}, std::size_t{1}}) {
    for (const std::size_t leave : {own.leave, std::size_t{0}, std::size_t{1}}) {
      if (std::ranges::find(ranges, std::pair(skip, leave)) == ranges.end()) {
        ranges.emplace_back(skip, leave);
      }
    }
  }
  return ranges;
}

std::string Written(const Checksum& sum, bool range) {
  const std::string kind(sum.kind->name);
  if (!range && sum.skip == 0 && sum.leave == 0) return "checksum: " + kind;
  return "checksum: { kind: " + kind + ", skip: " + std::to_string(sum.skip) +
         ", leave: " + std::to_string(sum.leave) + " }";
}

/// Finds how the received check value was computed: by another known algorithm over the same bytes,
/// or by any known algorithm over other bytes (none or one left out at either end).
std::optional<Checksum> FindFit(const Checksum& own, const Said& said) {
  for (const auto& [skip, leave] : RangesBeside(own)) {
    Checksum sum{own.kind, skip, leave};
    if (sum.Of(said.front) == said.value) return sum;
    for (const ChecksumKind& kind : ChecksumKinds()) {
      sum.kind = &kind;
      if (sum.Of(said.front) == said.value) return sum;
    }
  }
  return std::nullopt;
}

std::string Hex(std::uint32_t value, std::size_t bytes) {
  std::string text;
  while (bytes-- > 0) text += HexByte(static_cast<std::uint8_t>(value >> (8 * bytes)));
  return text;
}

}  // namespace

std::optional<Recognised> OtherChecksum(const Form& form, const Match& match) {
  const auto said = SaidOf(form, match);
  if (!said || form.checksum.kind == nullptr) return std::nullopt;
  const Checksum& own = form.checksum;
  const auto awaited = own.Of(said->front);
  if (!awaited) return std::nullopt;
  if (const auto fit = FindFit(own, *said)) {
    const bool range = fit->skip != own.skip || fit->leave != own.leave;
    return Recognised{Recognised::What::other_check,
                      "its check value is computed in another way (" +
                          std::string(fit->kind->name) +
                          (range ? " over other characters fits)" : " fits)"),
                      "write " + Written(*fit, range) + " in its profile"};
  }
  const std::string_view kind = own.kind->name;
  const bool adds = kind.starts_with("sum") || kind == "lrc";
  const std::uint32_t difference = adds ? said->value - *awaited : said->value ^ *awaited;
  return Recognised{Recognised::What::other_check, "a text",
                    "the check value differs from " + std::string(kind) + " always by " +
                        Hex(difference, own.kind->bytes) +
                        ": check whether the profile fits the firmware of the device"};
}

namespace {

/// A line of text is explained only if it has at least this many characters: after a request, or
/// unasked.
constexpr std::size_t kShortest = 2;
constexpr std::size_t kShortestUnasked = 8;
constexpr std::size_t kQuoted = 24;
constexpr const char* kOtherForm =
    "check whether the profile fits the device and the mode that is set in the device";

/// Returns the first line of text that is not empty, with its end. Empty: there is no such line.
/// `only`: true if nothing is allowed behind the line.
View FirstLine(View heard, bool only) {
  const auto begin = std::ranges::find_if_not(heard, IsLineEnd);
  const auto end = std::find_if(begin, heard.end(), IsLineEnd);
  const auto next = std::find_if_not(end, heard.end(), IsLineEnd);
  if (begin == end || end == heard.end() || !std::all_of(begin, end, IsPrintable)) return {};
  return only && next != heard.end() ? View() : View(begin, next);
}

std::string Quoted(View line) {
  const std::string text(Trim(AsText(line)));
  return "'" + text.substr(0, kQuoted) + (text.size() > kQuoted ? "...'" : "'");
}

/// Returns the form without its check value. `mark`: true to remove also the character in front of
/// it.
std::optional<Form> WithoutSum(const Form& form, bool mark) {
  auto changed = std::optional(form);
  auto& elements = changed->pattern.elements;
  const auto sum = std::ranges::find(elements, kChecksum, &Element::name);
  if (sum == elements.end() || form.size_at) return std::nullopt;
  changed->checksum = {};
  if (!mark) {
    elements.erase(sum);
    return changed;
  }
  if (sum == elements.begin() || std::prev(sum)->is_field()) return std::nullopt;
  Bytes& literal = std::prev(sum)->literal;
  literal.pop_back();
  elements.erase(literal.empty() ? std::prev(sum) : sum, std::next(sum));
  return changed;
}

bool IsWhole(const Form& form, View line, const Bound& known) {
  return MatchAll(form, line, known).kind == Match::Kind::whole;
}

/// True if fixed characters are in front of the check value.
bool HasMarkedSum(const Form& form) {
  const auto& elements = form.pattern.elements;
  const auto sum = std::ranges::find(elements, kChecksum, &Element::name);
  return sum != elements.begin() && sum != elements.end() && !std::prev(sum)->is_field();
}

bool IsRight(const Form& form, View line, const Bound& known) {
  const Match match = MatchAll(form, line, known);
  return match.kind == Match::Kind::whole && HasNumbers(form, match);
}

bool LacksSum(const Form& form, View line, const Bound& known) {
  return std::ranges::any_of(std::initializer_list<bool>{false, true}, [&](bool mark) {
    const auto changed = WithoutSum(form, mark);
    return changed && IsRight(*changed, line, known);
  });
}

/// Returns the unit behind the number at the end of the line, such as "VDC". Empty: there is no
/// unit, or the line without the unit does not fit the form.
std::string UnitBehind(const Form& form, View line, const Bound& known) {
  constexpr std::string_view kUnits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz%/";
  const std::string_view text = AsText(line);
  const std::size_t end = text.find_last_not_of("\r\n") + 1;
  const std::size_t unit = text.find_last_not_of(kUnits, end - 1) + 1;
  const std::size_t number = text.find_last_not_of(' ', unit - 1) + 1;
  const bool digit = number > 0 && text[number - 1] >= '0' && text[number - 1] <= '9';
  if (unit == 0 || unit == end || !digit) return {};
  Bytes rest(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(number));
  Append(rest, text.substr(end));
  if (!IsRight(form, rest, known)) return {};
  return std::string(text.substr(unit, end - unit));
}

bool LacksSign(const Form& form, View line, const Bound& known) {
  const Element& first = form.pattern.elements.front();
  if (!first.is_field() || !first.format.is_signed_token()) return false;
  Bytes signed_line = {'+'};
  Append(signed_line, line);
  return IsWhole(form, signed_line, known);
}

/// Returns how many numbers the form has, if each of them begins with a sign; 0: a number has no
/// sign.
std::size_t SignedNumbers(const Form& form) {
  std::size_t count = 0;
  for (const Element& element : form.pattern.elements) {
    if (!element.is_field() || element.name == kChecksum || !element.format.is_number()) continue;
    if (!element.format.is_signed_token()) return 0;
    ++count;
  }
  return count;
}

std::size_t SignsIn(View line) {
  return static_cast<std::size_t>(
      std::ranges::count_if(line, [](auto byte) { return byte == '+' || byte == '-'; }));
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  const bool asked = !request.empty();
  const Expectation expect = asked ? Expect(request, settings) : ExpectUnasked(settings);
  const auto* awaited = static_cast<const Awaited*>(expect.forms.get());
  const View line = FirstLine(heard, asked);
  if (awaited == nullptr || line.size() < (asked ? kShortest : kShortestUnasked)) {
    return std::nullopt;
  }
  // The text is not shown after a request with a password, because it can contain the password.
  const std::string quoted = expect.secrets.empty() ? " (" + Quoted(line) + ")" : std::string();
  const auto sent = asked ? settings.description->Recognise(request) : std::nullopt;
  const std::string its =
      sent ? "its reply to " + settings.description->telegrams[sent->telegram].name
           : std::string("its messages");
  const std::string what = asked ? "its replies" : "its messages";
  std::size_t numbers = 0;
  for (const Form* form : awaited->forms) {
    const Match match = MatchAll(*form, line, awaited->known);
    if (match.bad_checksum && HasMarkedSum(*form)) return OtherChecksum(*form, match);
    if (asked && match.kind == Match::Kind::whole && match.other) {
      return Recognised{Recognised::What::other_device,
                        "another device answers in place of the device that was asked" + quoted,
                        "check the address that is set in the device"};
    }
    if (LacksSum(*form, line, awaited->known)) {
      return Recognised{
          Recognised::What::other_setting, what + " carry no check value" + quoted,
          "switch the check value on at the device, or remove {checksum} from its telegrams"};
    }
    if (match.bad_checksum && HasNumbers(*form, match)) return OtherChecksum(*form, match);
    if (const std::string unit = UnitBehind(*form, line, awaited->known); !unit.empty()) {
      return Recognised{
          Recognised::What::other_setting,
          its + (asked ? " has" : " have") + " a unit after the number ('" + unit + "')",
          "switch the unit off at the device, or add the unit to the telegram in your own profile"};
    }
    if (asked && LacksSign(*form, line, awaited->known)) {
      return Recognised{
          Recognised::What::other_setting, its + " has no sign in front" + quoted,
          "correct the format in its profile, or look for a converter that removes the first byte"};
    }
    numbers = std::max(numbers, SignedNumbers(*form));
  }
  const std::size_t signs = SignsIn(line);
  if (numbers > 1 && signs > 0 && signs < numbers) {
    return Recognised{Recognised::What::other_form,
                      "only " + std::to_string(signs) + " of the " + std::to_string(numbers) +
                          " numbers in the profile came" + quoted,
                      "check whether the profile fits the device"};
  }
  return Recognised{Recognised::What::other_form,
                    its + (asked ? " is" : " are") + " not as described" + quoted, kOtherForm};
}

}  // namespace baudgate::protocols::telegram
