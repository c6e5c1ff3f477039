// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/reply.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::size_t kMostNamed = 3;

bool IsNumberCharacter(std::uint8_t byte) { return (byte >= '0' && byte <= '9') || byte == '.'; }

bool EndsSigned(View before) {
  while (!before.empty() && before.back() == ' ') before = before.first(before.size() - 1);
  return !before.empty() && (before.back() == '-' || before.back() == '+' || before.back() == '(');
}

/// "-" and "- kg", but not "-5", which is the next number.
bool BeginsWithSign(View behind) {
  while (!behind.empty() && behind.front() == ' ') behind = behind.subspan(1);
  if (behind.empty() || (behind.front() != '-' && behind.front() != '+')) return false;
  behind = behind.subspan(1);
  while (!behind.empty() && behind.front() == ' ') behind = behind.subspan(1);
  return behind.empty() || !IsNumberCharacter(behind.front());
}

/// Whether what stands beside a number that was cut out belongs to it. Other numbers and fixed
/// characters of the pattern do not.
bool IsTorn(const Form& form, const Match& match, std::size_t index) {
  const auto& elements = form.pattern.elements;
  const auto speaks = [&](std::size_t i) {
    const Format& format = elements[i].format;
    return elements[i].is_field() && !format.is_number() && format.kind != Format::Kind::byte;
  };
  const View own = match.parts[index];
  if (index > 0 && speaks(index - 1)) {
    const View before = match.parts[index - 1];
    const bool has_sign = !own.empty() && (own.front() == '-' || own.front() == '+');
    const bool begins = !own.empty() && own.front() != ' ';
    if (begins && !has_sign && !before.empty() && IsNumberCharacter(before.back())) return true;
    if (!has_sign && EndsSigned(before)) return true;
  }
  if (index + 1 < elements.size() && speaks(index + 1)) {
    const View behind = match.parts[index + 1];
    const bool ends = !own.empty() && own.back() != ' ';
    if (ends && !behind.empty() && IsNumberCharacter(behind.front())) return true;
    if (BeginsWithSign(behind)) return true;
  }
  return false;
}

/// "+1234567" in a field of seven characters, or "+12": no code of it, and no number.
bool HasWrongWidth(const Format& format, View part) {
  if (!format.is_signed_token() || format.width == 0) return false;
  const bool point = std::ranges::find(part, '.') != part.end();
  if (point || !format.point) return part.size() != format.width;
  return part.size() > format.width || part.size() + kShorterCode < format.width;
}

std::string Shown(View part) { return "'" + Printable(part) + "'"; }

/// Decimals of "+012.50".
std::size_t DecimalsOf(std::string_view text) {
  const std::size_t point = text.find('.');
  return point == std::string_view::npos ? 0 : text.size() - point - 1;
}

/// Reason and remedy; empty: nothing is known that would be said better by what it measures.
std::pair<std::string, std::string> WhyNoNumber(const Element& element, View part) {
  const Format& format = element.format;
  const std::string text(Trim(AsText(part)));
  const std::string quoted = " (" + Shown(ToBytes(text)) + ")";
  const bool digits = text.find_first_of("0123456789") != std::string::npos;
  if (!format.is_text_number() || format.kind == Format::Kind::hex || !digits) return {};
  if (const std::string meant = WithDecimalPoint(text);
      !meant.empty() && HasValue(DecodeField(format, ToBytes(meant)))) {
    return {"it writes decimal commas" + quoted, "set the device to a decimal point"};
  }
  const std::string correct = "correct the format of '" + element.name + "' in its profile";
  Format any = format;
  any.width = 0;
  any.precision = -1;
  any.point = any.sign = false;
  if (!HasValue(DecodeField(any, ToBytes(text)))) {
    return {Shown(ToBytes(text)) + " stands where '" + element.name + "' has a number", correct};
  }
  const std::size_t decimals = DecimalsOf(text);
  if (format.precision >= 0 && decimals != static_cast<std::size_t>(format.precision)) {
    return {"it sends " + std::to_string(decimals) + " decimals, and " +
                std::to_string(format.precision) + " are described" + quoted,
            correct};
  }
  if (AsText(part).ends_with(' ') && !format.left) {
    return {"blanks stand behind the number of '" + element.name + "'" + quoted,
            "if the device writes it so, show it in an example of its profile"};
  }
  if (!HasWrongWidth(format, part)) return {};
  return {"it sends " + std::to_string(part.size()) + " characters, and " +
              std::to_string(format.width) + " are described" + quoted,
          correct};
}

/// Codes that are all good are units or modes that a user chooses.
std::string RemedyOfUnknown(const Codes& codes) {
  const bool chosen = std::ranges::all_of(
      codes, [](const auto& code) { return code.second->quality == Quality::good; });
  if (!chosen || codes.size() > kMostNamed) return "look at the device, or add it to its codes";
  std::string names;
  for (const auto& [text, meaning] : codes) names += (names.empty() ? "'" : " or '") + text + "'";
  return "set " + names + " at the device, or describe it anew";
}

class Interpreter {
 public:
  Interpreter(const Telegram& telegram, const Form& form, const Match& match)
      : telegram_(telegram), form_(form), match_(match) {}

  Reply Run() {
    const auto& elements = form_.pattern.elements;
    for (std::size_t i = 0; i < elements.size() && reply_.outcome == Outcome::ok; ++i) {
      const Element& element = elements[i];
      if (!element.is_field() || element.name.empty() || element.name == kChecksum) continue;
      Take(element, i);
    }
    if (reply_.outcome != Outcome::ok) reply_.fields.clear();
    return std::move(reply_);
  }

 private:
  void Take(const Element& element, std::size_t index) {
    const View part = match_.parts[index];
    SaidField field;
    field.text = std::string(Trim(AsText(part)));
    const Value value = DecodeField(element.format, part);
    if (element.format.kind == Format::Kind::byte) field.text = ByteText(part);
    const auto codes = telegram_.codes.find(element.name);
    const Meaning* meaning = codes == telegram_.codes.end()
                                 ? nullptr
                                 : FindCode(codes->second, element.format, part, value);
    if (element.format.is_number()) {
      field.decoded = TakeNumber(element, index, meaning, value);
    } else {
      field.decoded = {value, Quality::good};
      field.is_status = codes != telegram_.codes.end();
      if (field.is_status) TakeStatus(element, field.text, meaning, codes->second);
    }
    if (meaning != nullptr && meaning->busy) {
      reply_.outcome = Outcome::busy;
      reply_.reason = "the device says that it is busy (" + Shown(part) + ")";
    }
    reply_.fields.insert_or_assign(element.name, std::move(field));
  }

  Decoded TakeNumber(const Element& element, std::size_t index, const Meaning* meaning,
                     const Value& value) {
    const View part = match_.parts[index];
    const bool counts = meaning != nullptr && meaning->quality == Quality::good && HasValue(value);
    if (meaning != nullptr && !counts) {
      return {IsUncertain(meaning->quality) ? value : Value{}, meaning->quality};
    }
    const bool wrong_width = HasWrongWidth(element.format, part);
    const bool torn = element.format.is_text_number() && IsTorn(form_, match_, index);
    if (HasValue(value) && !wrong_width && !torn) return {value, Quality::good};
    // A code that nobody has listed is the device's word, and no damage.
    const bool unknown_code = element.format.is_signed_token() && element.format.point &&
                              !wrong_width && std::ranges::find(part, '.') == part.end() &&
                              std::ranges::find(part, ' ') == part.end();
    if (unknown_code) return {{}, Quality::bad};
    if (telegram_.strict) {
      reply_.outcome = Outcome::corrupt;
      reply_.reason = "'" + element.name + "' is no number: " + Shown(part);
    } else if (reply_.reason.empty()) {
      std::tie(reply_.reason, reply_.remedy) = WhyNoNumber(element, part);
    }
    return {{}, Quality::bad_sensor_failure};
  }

  void TakeStatus(const Element& element, const std::string& text, const Meaning* meaning,
                  const Codes& codes) {
    const Quality says = meaning != nullptr ? meaning->quality : Quality::bad;
    if (says < reply_.quality) reply_.quality = says;
    if (meaning == nullptr) {
      reply_.reason =
          "'" + element.name + "' says '" + text + "', which the description does not know";
      reply_.remedy = RemedyOfUnknown(codes);
    }
  }

  const Telegram& telegram_;
  const Form& form_;
  const Match& match_;
  Reply reply_;
};

Reply Failed(Outcome outcome, std::string reason) {
  Reply reply;
  reply.outcome = outcome;
  reply.reason = std::move(reason);
  return reply;
}

}  // namespace

bool HasNumbers(const Form& form, const Match& match) {
  const auto& elements = form.pattern.elements;
  for (std::size_t i = 0; i < std::min(elements.size(), match.parts.size()); ++i) {
    const Format& format = elements[i].format;
    const bool named = elements[i].is_field() && elements[i].name != kChecksum;
    if (!named || !format.is_text_number()) continue;
    const View part = match.parts[i];
    if (!HasValue(DecodeField(format, part)) || HasWrongWidth(format, part)) return false;
  }
  return true;
}

Reply DecodeReply(const Telegram& telegram, View frame, const Bound& known) {
  bool other = false;
  const auto fits = [&](const Match& match) {
    other = other || (match.kind == Match::Kind::whole && match.other);
    return match.kind == Match::Kind::whole && !match.other;
  };
  // A text may look like anything, and a refusal like a text.
  for (const Form& form : telegram.refused) {
    const Match match = MatchAll(form, frame, known);
    if (!fits(match)) continue;
    return Failed(telegram.reads ? Outcome::unsupported : Outcome::refused,
                  "the device answers '" + Printable(frame) + "' to " + telegram.name);
  }
  for (const Form& form : telegram.receive) {
    const Match match = MatchAll(form, frame, known);
    if (fits(match)) return Interpreter(telegram, form, match).Run();
  }
  if (other) {
    return Failed(Outcome::unexpected,
                  "'" + Printable(frame) + "' names another device, or repeats what was not sent");
  }
  return Failed(Outcome::unexpected,
                "'" + Printable(frame) + "' is no answer to " + telegram.name + " as described");
}

}  // namespace baudgate::protocols::telegram
