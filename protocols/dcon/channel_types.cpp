// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/channel_types.h"

#include <algorithm>
#include <array>

#include "gateway/base/text.h"
#include "protocols/dcon/broadcasts.h"
#include "protocols/dcon/type_codes.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr int kSilencesOfNo = 2;

constexpr std::array<std::string_view, 16> kTypeQuestions = {
    "$8C0", "$8C1", "$8C2", "$8C3", "$8C4", "$8C5", "$8C6", "$8C7",
    "$8C8", "$8C9", "$8CA", "$8CB", "$8CC", "$8CD", "$8CE", "$8CF"};

/// "C2R0D" behind the address.
std::optional<std::uint8_t> TypeIn(unsigned input, const DecodedReply& reply) {
  if (reply.outcome != Outcome::ok || reply.fields.empty()) return std::nullopt;
  const std::string text = ToText(reply.fields.front().value);
  const std::string begin = std::string(kTypeQuestions[input].substr(2)) + "R";
  if (!text.starts_with(begin) || text.size() != begin.size() + 2) return std::nullopt;
  return ParseInteger<std::uint8_t>(std::string_view(text).substr(begin.size()), 16);
}

}  // namespace

std::optional<unsigned> InputOf(const ReadAddress& read) {
  if (!read.command.starts_with('#')) return std::nullopt;
  if (read.form == Form::numbers) {
    return read.index < kTypeQuestions.size() ? std::optional(read.index) : std::nullopt;
  }
  if (read.form != Form::number) return std::nullopt;
  const auto input = ParseInteger<unsigned>(std::string_view(read.command).substr(1), 16);
  return input && *input < kTypeQuestions.size() ? input : std::nullopt;
}

std::string_view QuestionOfInput(unsigned input) { return kTypeQuestions[input]; }

std::optional<unsigned> InputOfQuestion(std::string_view command) {
  const auto found = std::ranges::find(kTypeQuestions, command);
  if (found == kTypeQuestions.end()) return std::nullopt;
  return static_cast<unsigned>(found - kTypeQuestions.begin());
}

bool Measures(std::uint8_t type, const ReadAddress& read, std::string_view unit,
              const Settings& settings) {
  constexpr std::uint8_t kCounts = 0x50;
  constexpr std::uint8_t kFrequency = 0x51;
  if (read.form == Form::counter && read.command.starts_with('#')) {
    return !(read.total && type == kFrequency) && !(PlainUnit(unit) == "Hz" && type == kCounts);
  }
  const bool number = read.form == Form::numbers || read.form == Form::number;
  const bool input = read.command.starts_with('#') || read.command == kAskSample;
  if (!number || !input) return true;
  return settings.format != Format::engineering || FactorOfType(type, unit).has_value();
}

ChannelTypes::ChannelTypes(const config::Device& device, const Settings& settings)
    : device_(device), inputs_of_points_(device.points.size()), period_(device.slow) {
  if (!settings.channel_types || settings.format != Format::engineering) return;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    const auto read = ParseRead(point.read);
    if (point.access == config::Access::write || !read || !IsUnitOfTypes(point.unit)) continue;
    inputs_of_points_[i] = InputOf(*read);
    if (inputs_of_points_[i] && Find(*inputs_of_points_[i]) == nullptr) {
      inputs_.push_back({*inputs_of_points_[i], false, 0, {}});
    }
  }
}

ChannelTypes::Input* ChannelTypes::Find(unsigned input) {
  const auto found = std::ranges::find(inputs_, input, &Input::number);
  return found == inputs_.end() ? nullptr : &*found;
}

bool ChannelTypes::AllAsked() const { return std::ranges::all_of(inputs_, &Input::asked); }

bool ChannelTypes::Reads(std::string_view command, const Input& input) {
  return command == "#" || (command.starts_with('#') &&
                            ParseInteger<unsigned>(command.substr(1), 16) == input.number);
}

std::optional<unsigned> ChannelTypes::Next(std::string_view command) const {
  for (const Input& input : inputs_) {
    if (!input.asked && Reads(command, input)) return input.number;
  }
  return std::nullopt;
}

std::optional<unsigned> ChannelTypes::NextAnew(std::string_view command, Instant now) {
  const auto known = [](const Input& input) { return input.type.has_value(); };
  const auto reads = [command](const Input& input) { return Reads(command, input); };
  const bool wanted = AllAsked() && std::ranges::any_of(inputs_, known);
  if (!wanted || std::ranges::none_of(inputs_, reads)) return std::nullopt;
  const Duration step = period_ / static_cast<Duration::rep>(inputs_.size());
  if (!next_) next_ = now + step;
  if (now < *next_) return std::nullopt;
  next_ = std::max(*next_, now - period_ + step) + step;
  return inputs_[turn_].number;
}

void ChannelTypes::Settle(Input& input, std::optional<std::uint8_t> type) {
  if (input.asked) turn_ = (turn_ + 1) % inputs_.size();
  input.asked = true;
  input.silences = 0;
  input.type = type;
  // One that does not tell the first does not tell the others.
  const bool knows = type || std::ranges::any_of(inputs_, [](const Input& i) {
                       return i.asked && i.type.has_value();
                     });
  if (knows) return;
  for (Input& other : inputs_) {
    other.asked = true;
    other.type.reset();
  }
}

void ChannelTypes::OnAnswer(unsigned input, const DecodedReply& reply) {
  if (Input* asked = Find(input)) Settle(*asked, TypeIn(input, reply));
}

void ChannelTypes::OnNothing(unsigned input) {
  Input* asked = Find(input);
  if (asked == nullptr) return;
  if (asked->asked) return Settle(*asked, asked->type);
  if (++asked->silences == kSilencesOfNo) Settle(*asked, std::nullopt);
}

void ChannelTypes::Forget() {
  turn_ = 0;
  next_.reset();
  for (Input& input : inputs_) {
    input.asked = false;
    input.silences = 0;
  }
}

std::optional<std::uint8_t> ChannelTypes::TypeOf(std::size_t point) const {
  if (!inputs_of_points_[point]) return std::nullopt;
  return std::ranges::find(inputs_, *inputs_of_points_[point], &Input::number)->type;
}

std::optional<double> ChannelTypes::FactorOf(std::size_t point) const {
  const auto type = TypeOf(point);
  if (!type) return 1;
  const auto factor = FactorOfType(*type, device_.points[point].unit);
  if (!factor && device_.identity.ignore) return 1;
  return factor;
}

std::string ChannelTypes::Remark(std::uint32_t enabled) const {
  std::string text;
  for (std::size_t i = 0; i < inputs_of_points_.size(); ++i) {
    if (FactorOf(i) || (enabled >> *inputs_of_points_[i] & 1U) == 0) continue;
    const std::uint8_t type = *TypeOf(i);
    if (!text.empty()) text += "; ";
    text += "input " + std::to_string(*inputs_of_points_[i]) + " has type " + HexByte(type) +
            " and measures in " + std::string(UnitOfType(type)) + ", the profile says " +
            device_.points[i].unit + " for " + device_.points[i].name;
  }
  return text;
}

}  // namespace baudgate::protocols::dcon
