// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/points.h"

#include <algorithm>
#include <array>
#include <functional>
#include <set>
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

/// True if the text behind a number begins with a sign that belongs to the number: "-" or "- kg".
/// False for "-5", which is the next number.
bool BeginsWithSign(View behind) {
  while (!behind.empty() && behind.front() == ' ') behind = behind.subspan(1);
  if (behind.empty() || (behind.front() != '-' && behind.front() != '+')) return false;
  behind = behind.subspan(1);
  while (!behind.empty() && behind.front() == ' ') behind = behind.subspan(1);
  return behind.empty() || !IsNumberCharacter(behind.front());
}

/// True if text beside a number belongs to the number, so that the number is incomplete. Only text
/// fields beside the number are examined.
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

/// True if the length of the content fits neither a number nor a code of this field. Example:
/// "+1234567" or "+12" in a field of seven characters.
bool HasWrongWidth(const Format& format, View part) {
  if (!format.is_signed_token() || format.width == 0) return false;
  const bool point = std::ranges::find(part, '.') != part.end();
  if (point || !format.point) return part.size() != format.width;
  return part.size() > format.width || part.size() + kShorterCode < format.width;
}

std::string Shown(View part) { return "'" + Printable(part) + "'"; }

std::size_t DecimalsOf(std::string_view text) {
  const std::size_t point = text.find('.');
  return point == std::string_view::npos ? 0 : text.size() - point - 1;
}

/// Returns the reason why the field is not a number, and a remedy. Both are empty if the format
/// explains nothing.
std::pair<std::string, std::string> WhyNoNumber(const Element& element, View part) {
  const Format& format = element.format;
  const std::string text(Trim(AsText(part)));
  const std::string quoted = " (" + Shown(ToBytes(text)) + ")";
  const bool digits = text.find_first_of("0123456789") != std::string::npos;
  if (!format.is_text_number() || format.kind == Format::Kind::hex || !digits) return {};
  if (const std::string meant = WithDecimalPoint(text);
      !meant.empty() && HasValue(DecodeField(format, ToBytes(meant)))) {
    return {"its numbers have a decimal comma" + quoted, "set the device to a decimal point"};
  }
  const std::string correct = "correct the format of '" + element.name + "' in its profile";
  Format any = format;
  any.width = 0;
  any.precision = -1;
  any.point = any.sign = false;
  if (!HasValue(DecodeField(any, ToBytes(text)))) {
    return {Shown(ToBytes(text)) + " comes in the place of '" + element.name +
                "', which must be a number",
            correct};
  }
  const std::size_t decimals = DecimalsOf(text);
  if (format.precision >= 0 && decimals != static_cast<std::size_t>(format.precision)) {
    return {"it sends " + std::to_string(decimals) + " decimals, but " +
                std::to_string(format.precision) + " are described in its profile" + quoted,
            correct};
  }
  if (AsText(part).ends_with(' ') && !format.left) {
    return {"blanks come after the number of '" + element.name + "'" + quoted,
            "if the device always sends these blanks, add an example with them to its profile"};
  }
  if (!HasWrongWidth(format, part)) return {};
  return {"it sends " + std::to_string(part.size()) + " characters, but " +
              std::to_string(format.width) + " are described in its profile" + quoted,
          correct};
}

/// Returns the remedy for an unknown code. If all known codes are good, they are units or modes
/// that a user can set at the device.
std::string RemedyOfUnknown(const Codes& codes) {
  const bool chosen = std::ranges::all_of(
      codes, [](const auto& code) { return code.second->quality == Quality::good; });
  if (!chosen || codes.size() > kMostNamed)
    return "check the device, or add the text to the codes of its profile";
  std::string names;
  for (const auto& [text, meaning] : codes) names += (names.empty() ? "'" : " or '") + text + "'";
  return "set the device to " + names + ", or correct the codes of its profile";
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
      reply_.reason = "the device reports that it is busy (" + Shown(part) + ")";
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
    // An unknown code is information from the device, not damage, so the answer is accepted.
    const bool unknown_code = element.format.is_signed_token() && element.format.point &&
                              !wrong_width && std::ranges::find(part, '.') == part.end() &&
                              std::ranges::find(part, ' ') == part.end();
    if (unknown_code) return {{}, Quality::bad};
    if (telegram_.strict) {
      reply_.outcome = Outcome::corrupt;
      reply_.reason = "'" + element.name + "' is not a number: " + Shown(part);
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
      reply_.reason = "'" + element.name + "' contains '" + text +
                      "', which is not in the codes of its profile";
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
  // Refusals are tried first, because a text field matches almost any bytes, also a refusal.
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
    return Failed(
        Outcome::unexpected,
        "'" + Printable(frame) +
            "' is from another device, or repeats other values than the request contains");
  }
  return Failed(Outcome::unexpected,
                "'" + Printable(frame) + "' is not the described answer to " + telegram.name);
}

namespace {

using config::Access;
using config::Point;
using config::Type;

constexpr std::array<DecoderSpec, 6> kDecoders = {
    {{"weight.value", "field 'value' of the answer to telegram 'weight'"},
     {"input(channel=3).value",
      "field 'value' of the answer, with 3 in the field {channel} of the request"},
     {"status.flags[b3]", "one bit of a whole number; type bool"},
     {"status.flags[b4-b7]", "several bits of a whole number, as a number"},
     {"weight.state=S", "true if the field contains S; type bool"},
     {"tare", "in 'write': the telegram to send, with the value in its field {value}"}}};

bool IsName(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

/// Takes a telegram with its parameters, such as "input(channel=3)", from the front of `text`.
Result<Call> TakeCall(std::string_view& text) {
  Call call;
  const std::size_t end = std::min(text.find_first_of("(."), text.size());
  call.telegram = text.substr(0, end);
  text.remove_prefix(end);
  if (!IsName(call.telegram)) return Error{Quoted(call.telegram) + " is not a telegram name"};
  if (!text.starts_with('(')) return call;
  const std::size_t close = text.find(')');
  if (close == std::string_view::npos) return Error{"'(' without ')'"};
  for (const std::string_view one : Split(text.substr(1, close - 1), ',')) {
    const std::string_view parameter = Trim(one);
    const std::size_t equal = parameter.find('=');
    if (equal == std::string_view::npos || !IsName(parameter.substr(0, equal))) {
      return Error{Quoted(parameter) + " is not a parameter; write for example channel=3"};
    }
    call.parameters.emplace_back(parameter.substr(0, equal), parameter.substr(equal + 1));
  }
  std::ranges::sort(call.parameters);
  text.remove_prefix(close + 1);
  return call;
}

/// Parses the selector of a field: "[b3]", "[b4-b7]", "=S" or nothing.
Status TakeSelect(std::string_view text, ReadPlace& place) {
  if (text.empty()) return {};
  if (text.front() == '=') {
    place.select = ReadPlace::Select::equal;
    place.equal = text.substr(1);
    if (place.equal.empty()) return Error{"a value is missing after '='"};
    return {};
  }
  const Error wrong = {Quoted(text) + " is not a bit; write [b3] or [b4-b7]"};
  if (!text.starts_with("[b") || !text.ends_with(']')) return wrong;
  text = text.substr(2, text.size() - 3);
  const std::size_t dash = text.find("-b");
  const auto first = ParseInteger<unsigned>(text.substr(0, dash));
  const auto last =
      dash == std::string_view::npos ? first : ParseInteger<unsigned>(text.substr(dash + 2));
  if (!first || !last || *last < *first || *last > 63) return wrong;
  place.select = ReadPlace::Select::bits;
  place.bit = *first;
  place.bits = *last - *first + 1;
  return {};
}

Result<ReadPlace> ParseReadText(std::string_view text) {
  ReadPlace place;
  auto call = TakeCall(text);
  if (!call) return Error{call.error()};
  place.call = std::move(*call);
  if (!text.starts_with('.')) return Error{"write a telegram and a field, as in weight.value"};
  text.remove_prefix(1);
  const std::size_t end = std::min(text.find_first_of("[="), text.size());
  place.field = text.substr(0, end);
  if (!IsName(place.field)) return Error{Quoted(place.field) + " is not a field name"};
  if (Status status = TakeSelect(text.substr(end), place); !status) return Error{status.error()};
  return place;
}

bool SelectsBool(const ReadPlace& place) {
  return place.select == ReadPlace::Select::equal ||
         (place.select == ReadPlace::Select::bits && place.bits == 1);
}

}  // namespace

Questions::Questions(const Description& description, const Bound& bound,
                     const std::vector<std::optional<Call>>& calls) {
  std::set<std::string, std::less<>> differ;
  for (const auto& call : calls) {
    if (!call) continue;
    for (const auto& [name, text] : call->parameters) differ.insert(name);
  }
  for (const auto& call : calls) {
    auto& question = questions_.emplace_back();
    const auto telegram = call ? description.Find(call->telegram) : std::nullopt;
    if (!telegram) continue;
    question.emplace(Question{*telegram, {}});
    calls_.emplace(*telegram, questions_.size() - 1);
    Bound filled = bound;
    for (const auto& [name, text] : call->parameters) filled.insert_or_assign(name, text);
    const Telegram& meant = description.telegrams[*telegram];
    for (const std::string& name : differ) {
      const auto sends = [&](std::size_t number) {
        const auto& form = description.telegrams[number].send;
        return form && form->pattern.Has(name);
      };
      if (sends(*telegram) || std::ranges::any_of(meant.before, sends)) {
        question->fields.emplace(name, filled[name]);
      }
    }
  }
}

bool Questions::IsAsked(std::size_t call, std::size_t telegram, const Bound& sent) const {
  const auto& question = questions_[call];
  if (!question || question->telegram != telegram) return false;
  return std::ranges::all_of(question->fields, [&](const auto& field) {
    const auto value = sent.find(field.first);
    return value != sent.end() && SameValue(field.second, value->second);
  });
}

std::vector<std::size_t> Questions::AskedBy(std::size_t telegram, const Bound& sent) const {
  std::vector<std::size_t> asked;
  const auto [begin, end] = calls_.equal_range(telegram);
  for (auto its = begin; its != end; ++its) {
    if (IsAsked(its->second, telegram, sent)) asked.push_back(its->second);
  }
  return asked;
}

Result<ReadPlace> ParseRead(const Point& point) {
  auto place = ParseReadText(point.read);
  if (place) return place;
  return Error{"read " + Quoted(point.read) + ": " + place.error()};
}

Result<Call> ParseWrite(const Point& point) {
  std::string_view text = point.write;
  auto call = TakeCall(text);
  if (!call) return Error{"write " + Quoted(point.write) + ": " + call.error()};
  if (!text.empty()) {
    return Error{"write " + Quoted(point.write) +
                 ": write only the name of a telegram; the value goes into its field {value}"};
  }
  return call;
}

Status CheckPoint(const Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, ""); !status) return status;
  }
  if (point.access != Access::write) {
    const auto place = ParseRead(point);
    if (!place) return Error{place.error()};
    if (SelectsBool(*place) && point.type != Type::boolean) {
      return Error{"read " + Quoted(point.read) + " is true or false; write type: bool"};
    }
    const bool number = place->select == ReadPlace::Select::bits && place->bits > 1;
    if (number && (point.type == Type::boolean || point.type == Type::string)) {
      return Error{"read " + Quoted(point.read) + " is a number; write a number type"};
    }
  }
  if (point.access == Access::read) return {};
  if (point.write.empty())
    return Error{"a writable point needs 'write' with the name of a telegram"};
  const auto call = ParseWrite(point);
  if (!call) return Error{call.error()};
  return {};
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

Decoded ValueAt(const ReadPlace& place, const Reply& reply) {
  const auto found = reply.fields.find(place.field);
  if (found == reply.fields.end()) {
    // The answer has another form, without this field; its status fields give the reason.
    const bool good = !IsBad(reply.quality);
    return {{}, good ? Quality(Quality::bad, Reason::not_ready) : reply.quality};
  }
  const SaidField& field = found->second;
  if (place.select == ReadPlace::Select::equal) return {field.text == place.equal, Quality::good};
  Decoded decoded = field.decoded;
  if (!field.is_status && reply.quality < decoded.quality) {
    decoded.quality = reply.quality;
    if (IsBad(decoded.quality)) decoded.value = {};
  }
  if (place.select == ReadPlace::Select::whole || !HasValue(decoded.value)) return decoded;
  std::uint64_t raw = 0;
  if (const auto* number = std::get_if<std::uint64_t>(&decoded.value)) raw = *number;
  if (const auto* number = std::get_if<std::int64_t>(&decoded.value)) {
    raw = static_cast<std::uint64_t>(*number);
  }
  const std::uint64_t mask =
      place.bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << place.bits) - 1;
  const std::uint64_t bits = raw >> place.bit & mask;
  if (place.bits == 1) {
    decoded.value = bits != 0;
  } else {
    decoded.value = static_cast<std::int64_t>(bits);
  }
  return decoded;
}

}  // namespace baudgate::protocols::telegram
