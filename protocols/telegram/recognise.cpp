// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/recognise.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "protocols/telegram/expect.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/other_checksum.h"
#include "protocols/telegram/reply.h"

namespace baudgate::protocols::telegram {
namespace {

/// Fewer characters are no line of text.
constexpr std::size_t kShortest = 2;
constexpr std::size_t kShortestUnasked = 8;
constexpr std::size_t kQuoted = 24;
constexpr const char* kOtherForm =
    "does the profile fit the device, and the mode that is set in it?";

/// The first line of text that is not empty, with its end; `only`: nothing stands behind it. Empty:
/// there is none.
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

/// The form without its check value; `mark`: and without the character in front of it.
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

/// Its check value stands behind fixed characters.
bool HasMarkedSum(const Form& form) {
  const auto& elements = form.pattern.elements;
  const auto sum = std::ranges::find(elements, kChecksum, &Element::name);
  return sum != elements.begin() && sum != elements.end() && !std::prev(sum)->is_field();
}

/// Whole, and its numbers are numbers.
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

/// "VDC" behind the number that ends the line, which is right without it; empty: it is not so.
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

/// How many numbers the form has, if each begins with a sign; 0: one does not.
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
  // What comes behind a password may repeat it.
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
                        "another device answers than the one that was asked" + quoted,
                        "check the address that is set in it"};
    }
    if (LacksSum(*form, line, awaited->known)) {
      return Recognised{Recognised::What::other_setting, what + " carry no check value" + quoted,
                        "switch it on at the device, or take {checksum} out of its telegrams"};
    }
    if (match.bad_checksum && HasNumbers(*form, match)) return OtherChecksum(*form, match);
    if (const std::string unit = UnitBehind(*form, line, awaited->known); !unit.empty()) {
      return Recognised{
          Recognised::What::other_setting,
          its + (asked ? " has" : " have") + " a unit behind the number ('" + unit + "')",
          "switch the unit off at the device, or write it into the telegram in a "
          "profile of its own"};
    }
    if (asked && LacksSign(*form, line, awaited->known)) {
      return Recognised{Recognised::What::other_setting, its + " has no sign in front" + quoted,
                        "correct the format in its profile, or a converter eats the first byte"};
    }
    numbers = std::max(numbers, SignedNumbers(*form));
  }
  const std::size_t signs = SignsIn(line);
  if (numbers > 1 && signs > 0 && signs < numbers) {
    return Recognised{Recognised::What::other_form,
                      std::to_string(signs) + " of the " + std::to_string(numbers) +
                          " numbers that are described came" + quoted,
                      "does the profile fit the device?"};
  }
  return Recognised{Recognised::What::other_form,
                    its + (asked ? " is" : " are") + " not as described" + quoted, kOtherForm};
}

}  // namespace baudgate::protocols::telegram
