// SPDX-License-Identifier: Apache-2.0
#include "config/catalog/option_values.h"

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

using Kind = protocols::OptionSpec::Kind;

Error Wrong(const protocols::OptionSpec& spec, std::string_view text, const std::string& why) {
  return {spec.secret ? "the value " + why : Quoted(text) + " " + why};
}

bool Bounded(const protocols::OptionSpec& spec) { return spec.minimum < spec.maximum; }

std::string Bounds(const protocols::OptionSpec& spec) {
  return FormatNumber(spec.minimum) + "…" + FormatNumber(spec.maximum);
}

bool InBounds(const protocols::OptionSpec& spec, double value) {
  return !Bounded(spec) || (value >= spec.minimum && value <= spec.maximum);
}

Result<OptionValue> ParseFlag(const protocols::OptionSpec& spec, std::string_view text) {
  if (text == "true" || text == "yes" || text == "on") return OptionValue(true);
  if (text == "false" || text == "no" || text == "off") return OptionValue(false);
  return Wrong(spec, text, "is neither true nor false");
}

Result<OptionValue> ParseWhole(const protocols::OptionSpec& spec, std::string_view text) {
  const auto value = ParseInteger<std::int64_t>(text);
  if (!value) return Wrong(spec, text, "is not a whole number");
  if (!InBounds(spec, static_cast<double>(*value))) {
    return Wrong(spec, text, "is out of range; allowed: " + Bounds(spec));
  }
  return OptionValue(*value);
}

Result<OptionValue> ParseReal(const protocols::OptionSpec& spec, std::string_view text) {
  const auto value = ParseDecimal(text);
  if (!value) return Wrong(spec, text, "is not a decimal number");
  if (!InBounds(spec, *value)) {
    return Wrong(spec, text, "is out of range; allowed: " + Bounds(spec));
  }
  return OptionValue(*value);
}

/// Parses a number. A secret can begin with zeros, because passwords can.
Result<OptionValue> ParseNumber(const protocols::OptionSpec& spec, std::string_view text) {
  const std::string zero = spec.secret ? std::string() : WhyLeadingZero(text);
  if (!zero.empty()) return Wrong(spec, text, zero);
  return spec.kind == Kind::integer ? ParseWhole(spec, text) : ParseReal(spec, text);
}

Result<OptionValue> ParseTime(const protocols::OptionSpec& spec, std::string_view text) {
  const std::string zero = WhyLeadingZero(text);
  const auto value = zero.empty() ? ParseDuration(text) : Error{Quoted(text) + " " + zero};
  if (value) return OptionValue(static_cast<std::int64_t>(value->count()));
  if (spec.secret) return Wrong(spec, text, "is not a duration");
  return Error{value.error()};
}

std::vector<std::string_view> Choices(const protocols::OptionSpec& spec) {
  std::vector<std::string_view> choices = Split(spec.choices, ',');
  for (std::string_view& choice : choices) choice = Trim(choice);
  return choices;
}

Result<OptionValue> ParseChoice(const protocols::OptionSpec& spec, std::string_view text) {
  const std::vector<std::string_view> choices = Choices(spec);
  for (const std::string_view choice : choices) {
    if (choice == text) return OptionValue(std::string(text));
  }
  const std::string hint = spec.secret ? std::string() : DidYouMean(text, choices);
  return Wrong(spec, text, "is unknown;" + hint + " allowed: " + Join(choices));
}

std::vector<std::string> ParseTexts(std::string_view text) {
  std::vector<std::string> parts;
  for (const std::string_view part : Split(text, ',')) {
    if (!Trim(part).empty()) parts.emplace_back(Trim(part));
  }
  return parts;
}

Result<OptionValue> ParsePairs(const protocols::OptionSpec& spec, std::string_view text) {
  Pairs pairs;
  for (const std::string& one : ParseTexts(text)) {
    const std::size_t equal = one.find('=');
    if (equal == 0 || equal == std::string::npos) {
      return Wrong(spec, one, "is not KEY=VALUE; write channel=2, or { channel: 2 } in the file");
    }
    pairs.insert_or_assign(one.substr(0, equal), one.substr(equal + 1));
  }
  return OptionValue(std::move(pairs));
}

OptionValue Empty(Kind kind) {
  switch (kind) {
    case Kind::flag:
      return false;
    case Kind::integer:
    case Kind::duration:
      return std::int64_t{0};
    case Kind::real:
      return 0.0;
    case Kind::texts:
      return std::vector<std::string>();
    case Kind::pairs:
      return Pairs();
    case Kind::description:
      return DescriptionRef();
    case Kind::text:
    case Kind::choice:
      break;
  }
  return std::string();
}

}  // namespace

Result<OptionValue> ParseOption(const protocols::OptionSpec& spec, std::string_view text) {
  switch (spec.kind) {
    case Kind::flag:
      return ParseFlag(spec, text);
    case Kind::integer:
    case Kind::real:
      return ParseNumber(spec, text);
    case Kind::duration:
      return ParseTime(spec, text);
    case Kind::choice:
      return ParseChoice(spec, text);
    case Kind::texts:
      return OptionValue(ParseTexts(text));
    case Kind::pairs:
      return ParsePairs(spec, text);
    case Kind::description:
      if (text.empty()) return OptionValue(DescriptionRef());
      return Error{"write this option in a profile, or at a device in a configuration file"};
    case Kind::text:
      break;
  }
  return OptionValue(std::string(text));
}

Options DefaultOptions(const protocols::Protocol& protocol) {
  Options options;
  for (const protocols::OptionSpec& spec : protocol.options) {
    auto value = ParseOption(spec, spec.fallback);
    options.Set(std::string(spec.name), value ? std::move(*value) : Empty(spec.kind));
  }
  return options;
}

void Override(Options& target, const Options& given) {
  for (const auto& [name, value] : given.all()) {
    const auto* pairs = std::get_if<Pairs>(&value);
    if (pairs == nullptr || !target.Has(name)) {
      target.Set(name, value);
      continue;
    }
    Pairs merged = *pairs;
    merged.insert(target.Pairs(name).begin(), target.Pairs(name).end());
    target.Set(name, std::move(merged));
  }
  for (const auto& [name, text] : given.written()) target.SetWritten(name, text);
}

}  // namespace baudgate::config
