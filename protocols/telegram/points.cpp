// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/points.h"

#include <algorithm>
#include <array>
#include <functional>
#include <set>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

using config::Access;
using config::Point;
using config::Quoted;
using config::Type;

constexpr std::array<DecoderSpec, 6> kDecoders = {
    {{"weight.value", "field 'value' of the answer to telegram 'weight'"},
     {"input(channel=3).value", "the same, with 3 in the field {channel} of what is sent"},
     {"status.flags[b3]", "one bit of a whole number; type bool"},
     {"status.flags[b4-b7]", "several bits of it as a number"},
     {"weight.state=S", "true where the field says S; type bool"},
     {"tare", "in 'write': the telegram that is sent, with the value in its field {value}"}}};

bool IsName(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

/// "input(channel=3)" at the front of `text`, taken off it.
Result<Call> TakeCall(std::string_view& text) {
  Call call;
  const std::size_t end = std::min(text.find_first_of("(."), text.size());
  call.telegram = text.substr(0, end);
  text.remove_prefix(end);
  if (!IsName(call.telegram)) return Error{Quoted(call.telegram) + " is no name of a telegram"};
  if (!text.starts_with('(')) return call;
  const std::size_t close = text.find(')');
  if (close == std::string_view::npos) return Error{"'(' without ')'"};
  for (const std::string_view one : Split(text.substr(1, close - 1), ',')) {
    const std::string_view parameter = Trim(one);
    const std::size_t equal = parameter.find('=');
    if (equal == std::string_view::npos || !IsName(parameter.substr(0, equal))) {
      return Error{Quoted(parameter) + " is no parameter; write channel=3"};
    }
    call.parameters.emplace_back(parameter.substr(0, equal), parameter.substr(equal + 1));
  }
  std::ranges::sort(call.parameters);
  text.remove_prefix(close + 1);
  return call;
}

/// "[b3]", "[b4-b7]", "=S" or nothing.
Status TakeSelect(std::string_view text, ReadPlace& place) {
  if (text.empty()) return {};
  if (text.front() == '=') {
    place.select = ReadPlace::Select::equal;
    place.equal = text.substr(1);
    if (place.equal.empty()) return Error{"nothing stands behind '='"};
    return {};
  }
  const Error wrong = {Quoted(text) + " is no bit: write [b3] or [b4-b7]"};
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
  if (!text.starts_with('.')) return Error{"a telegram and a field are read: weight.value"};
  text.remove_prefix(1);
  const std::size_t end = std::min(text.find_first_of("[="), text.size());
  place.field = text.substr(0, end);
  if (!IsName(place.field)) return Error{Quoted(place.field) + " is no name of a field"};
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
                 ": a telegram is sent, with the value in its field "
                 "{value}; write its name alone"};
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
      return Error{"read " + Quoted(point.read) + " is true or false: it needs type bool"};
    }
    const bool number = place->select == ReadPlace::Select::bits && place->bits > 1;
    if (number && (point.type == Type::boolean || point.type == Type::string)) {
      return Error{"read " + Quoted(point.read) + " is a number: it needs a type of numbers"};
    }
  }
  if (point.access == Access::read) return {};
  if (point.write.empty())
    return Error{"a point that is written needs 'write': a telegram to send"};
  const auto call = ParseWrite(point);
  if (!call) return Error{call.error()};
  return {};
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

Decoded ValueAt(const ReadPlace& place, const Reply& reply) {
  const auto found = reply.fields.find(place.field);
  if (found == reply.fields.end()) {
    // An answer of another form: what it says instead is why.
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
