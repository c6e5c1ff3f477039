// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/description.h"

#include <algorithm>
#include <array>

#include "gateway/base/text.h"

namespace baudgate::protocols::telegram {

const Element* Telegram::FindField(std::string_view field) const {
  for (const Form& form : receive) {
    if (const Element* element = form.pattern.Find(field)) return element;
  }
  return nullptr;
}

const Example& Telegram::ExampleFor(const Bound& sent) const {
  static const Example kNone;
  const Example* best = nullptr;
  std::size_t most = 0;
  for (const Example& example : examples) {
    const auto agree =
        static_cast<std::size_t>(std::ranges::count_if(example.sent, [&](const auto& field) {
          const auto said = sent.find(field.first);
          return said != sent.end() && SameValue(said->second, field.second);
        }));
    if (best != nullptr && agree <= most) continue;
    best = &example;
    most = agree;
  }
  return best != nullptr ? *best : kNone;
}

std::optional<std::size_t> Description::Find(std::string_view name) const {
  const auto found = std::ranges::find(telegrams, name, &Telegram::name);
  if (found == telegrams.end()) return std::nullopt;
  return static_cast<std::size_t>(found - telegrams.begin());
}

bool Description::listens() const { return std::ranges::any_of(telegrams, &Telegram::listen); }

std::optional<Description::Sent> Description::Recognise(View request) const {
  std::optional<Sent> found;
  std::size_t fixed = 0;
  for (std::size_t i = 0; i < telegrams.size(); ++i) {
    if (!telegrams[i].send) continue;
    const Form& form = *telegrams[i].send;
    const std::size_t literal = form.pattern.literal_size();
    if (found && literal <= fixed) continue;
    Match match = MatchAll(form, request, {});
    if (match.kind != Match::Kind::whole) continue;
    Bound values = ValuesOf(form, match);
    found = Sent{i, std::move(match), std::move(values)};
    fixed = literal;
  }
  return found;
}

std::shared_ptr<const Description> DescriptionOf(const config::Options& options) {
  const std::string key(kTelegramsOption);
  if (!options.Has(key)) return nullptr;
  return std::dynamic_pointer_cast<const Description>(options.Described(key));
}

Value AddressValue(std::string_view address) {
  const bool hex = address.starts_with("0x") || address.starts_with("0X");
  const auto number =
      hex ? ParseInteger<std::int64_t>(address.substr(2), 16) : ParseInteger<std::int64_t>(address);
  return number && *number >= 0 ? Value(*number) : Value(std::string(address));
}

Settings ReadSettings(const config::Options& options) {
  Settings settings{.description = DescriptionOf(options), .parameters = {}};
  for (const auto& [name, text] : options.Pairs(std::string(kParametersOption))) {
    settings.parameters.emplace(name, text);
  }
  settings.parameters.insert_or_assign(std::string(kPassword),
                                       options.Text(std::string(kPassword)));
  return settings;
}

Bound BoundOf(const Settings& settings, std::string_view address) {
  Bound bound = settings.parameters;
  if (!address.empty() && address != kNoAddress) {
    bound.insert_or_assign(std::string(kAddress), AddressValue(address));
  }
  return bound;
}

namespace {

constexpr std::size_t kLongestAddress = 32;

constexpr std::array<OptionSpec, 3> kOptions = {
    {option::Described(
         kTelegramsOption,
         "Telegrams that are sent to the device, and its answers; usually in the profile."),
     option::Pairs(kParametersOption, "",
                   "Values for fields of the telegrams, such as { channel: 2 }."),
     option::Secret(
         option::Text("password", "", "Value for the field {password} of the telegrams."))}};

}  // namespace

std::span<const OptionSpec> OptionTable() { return kOptions; }

Result<std::string> CanonicalAddress(std::string_view address) {
  if (address.empty()) return std::string(kNoAddress);
  const bool usable = address.size() <= kLongestAddress && std::ranges::all_of(address, [](char c) {
                        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                               (c >= 'A' && c <= 'Z') || c == '-' || c == '_' || c == '.';
                      });
  if (!usable) {
    return Error{
        Quoted(address) +
        " is not an address; write a number, hex as 0x4A, or a word of letters and digits"};
  }
  return ToText(AddressValue(address));
}

}  // namespace baudgate::protocols::telegram
