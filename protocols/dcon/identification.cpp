// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/identification.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/common/identification.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/conversation.h"

namespace baudgate::protocols::dcon {
namespace {

struct Spelling {
  std::string_view text;
  std::string_view unit;
};

constexpr std::array<Spelling, 10> kSpellings = {{{"v", "V"},
                                                  {"volt", "V"},
                                                  {"volts", "V"},
                                                  {"mv", "mV"},
                                                  {"ma", "mA"},
                                                  {"c", "degC"},
                                                  {"°c", "degC"},
                                                  {"degc", "degC"},
                                                  {"celsius", "degC"},
                                                  {"hz", "Hz"}}};

/// Returns the unit in which a module of this type sends numbers in engineering format: "V", "mV",
/// "mA" or "degC". Empty: the unit is unknown.
std::string_view UnitOfType(std::uint8_t type) {
  switch (type) {
    case 0x00:
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x0B:
    case 0x0C:
      return "mV";
    case 0x04:
    case 0x05:
    case 0x08:
    case 0x09:
    case 0x0A:
      return "V";
    case 0x06:
    case 0x07:
    case 0x0D:
    case 0x1A:
      return "mA";
    default:
      return (type >= 0x0E && type <= 0x19) || (type >= 0x20 && type <= 0x2D) ? "degC" : "";
  }
}

/// Returns `unit` in the spelling of UnitOfType, or "Hz". Examples: "volt" gives "V", "MV" "mV",
/// "°C" "degC". Any other unit ("bar", "uV") is returned unchanged.
std::string_view PlainUnit(std::string_view unit) {
  std::string text = Lower(unit);
  std::erase(text, ' ');
  const auto found = std::ranges::find(kSpellings, text, &Spelling::text);
  return found == kSpellings.end() ? unit : found->unit;
}

/// True if there are module types that measure in `unit`. Examples: "V" and "°C", not "bar".
bool IsUnitOfTypes(std::string_view unit) {
  const std::string_view plain = PlainUnit(unit);
  return plain == "V" || plain == "mV" || plain == "mA" || plain == "degC";
}

}  // namespace

bool IsAnalogOutput(std::uint8_t type) { return (type >= 0x30 && type <= 0x35) || type == 0x3F; }

std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit) {
  const std::string_view own = UnitOfType(type);
  const std::string_view wanted = PlainUnit(unit);
  if (own.empty() || !IsUnitOfTypes(unit) || own == wanted) return 1;
  if (own == "mV" && wanted == "V") return 0.001;
  if (own == "V" && wanted == "mV") return 1000;
  return std::nullopt;
}

namespace {

constexpr int kSilencesOfNo = 2;

constexpr std::array<std::string_view, 16> kTypeQuestions = {
    "$8C0", "$8C1", "$8C2", "$8C3", "$8C4", "$8C5", "$8C6", "$8C7",
    "$8C8", "$8C9", "$8CA", "$8CB", "$8CC", "$8CD", "$8CE", "$8CF"};

/// Parses the type from the reply to a type question. Example: the text after the address is
/// "C2R0D", so input 2 has type 0D.
std::optional<std::uint8_t> TypeIn(unsigned input, const DecodedReply& reply) {
  if (reply.outcome != Outcome::ok || reply.fields.empty()) return std::nullopt;
  const std::string text = ToText(reply.fields.front().value);
  const std::string begin = std::string(kTypeQuestions[input].substr(2)) + "R";
  if (!text.starts_with(begin) || text.size() != begin.size() + 2) return std::nullopt;
  return ParseInteger<std::uint8_t>(std::string_view(text).substr(begin.size()), 16);
}

std::string_view QuestionOfInput(unsigned input) { return kTypeQuestions[input]; }

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
  // If the module does not report the type of the first input, it reports no types: all inputs then
  // count as asked.
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
            " and measures in " + std::string(UnitOfType(type)) + ", but the profile has " +
            device_.points[i].unit + " for " + device_.points[i].name;
  }
  return text;
}

namespace {

constexpr std::array<Identification::Question, 4> kRound = {
    {{kAskName, false}, {kAskType, false}, {kAskName, true}, {kAskType, true}}};
// Number of questions in kRound that use the configured checksum mode; they come first.
constexpr int kOwnMode = 2;

constexpr std::string_view kAdvice = "; correct the profile, the address or the module";

constexpr const char* kAdviceOnInputs =
    " (these values are bad until you correct the unit, the input's type or its wiring)";

std::string_view WordOf(unsigned format) {
  constexpr std::string_view kWords[] = {"engineering", "percent", "hex", "ohms"};
  return kWords[format & 3U];
}

bool IsNumber(Form form) {
  return form == Form::numbers || form == Form::number || form == Form::readback;
}

std::string WhatOf(std::uint8_t type) {
  if (type == 0x50 || type == 0x51) return type == 0x50 ? "pulses" : "Hz";
  return std::string(UnitOfType(type));
}

DeviceTrouble Complaint(std::string what) {
  return {Reason::other_module,
          "the module does not match its profile: " + std::move(what).append(kAdvice)};
}

DeviceTrouble ModuleChecksum(bool on) {
  return {Reason::other_module,
          std::string("the module's checksum is ") + (on ? "on" : "off") +
              ", but the configuration has checksum: " + (on ? "false" : "true") +
              "; set checksum: " + (on ? "true" : "false") + " in the configuration"};
}

std::string Alternatives(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += i == 0 ? "" : i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace

Identification::Identification(const config::Device& device, const Settings& settings)
    : device_(device), settings_(settings), channels_(device, settings) {
  for (const config::Point& point : device.points) {
    const auto read = ParseRead(point.read);
    only_others_ = only_others_ && !(read && IsHarmless(read->command));
    if (point.access == config::Access::write || !read) continue;
    joined_ = joined_ || (read->command == "#" && read->form == Form::numbers);
  }
}

/// True if the command is a read in both checksum modes. Only `#AA` and `#AAN` are: at worst the
/// module takes a checksum for digits, so that `#0184` reads channel 84.
bool Identification::IsHarmless(std::string_view command) {
  return command.starts_with('#') && command.size() <= 2;
}

bool Identification::WantsMask() const {
  return joined_ && sure_ && !asked_mask_ && !trouble_ && settings_.disabled == Disabled::missing;
}

std::optional<Identification::Question> Identification::Next(std::string_view command) {
  if (!settings_.identify) return std::nullopt;
  if (done_ && !Allows(command)) Begin();
  if (!done_) return kRound[static_cast<std::size_t>(step_)];
  if (WantsMask()) return Question{kAskMask, false};
  if (sure_ && !trouble_) {
    if (const auto input = channels_.Next(command)) return Question{QuestionOfInput(*input), false};
  }
  return std::nullopt;
}

std::optional<Identification::Question> Identification::NextAnew(std::string_view command,
                                                                 Instant now) {
  if (!settings_.identify || !sure_ || trouble_) return std::nullopt;
  const auto input = channels_.NextAnew(command, now);
  if (!input) return std::nullopt;
  return Question{QuestionOfInput(*input), false};
}

bool Identification::Allows(std::string_view command) const {
  if (!settings_.identify) return true;
  return done_ && !trouble_ && (sure_ || !settings_.checksum || IsHarmless(command));
}

bool Identification::IsTakenCutShort(View request) const {
  if (!settings_.identify || sure_ || settings_.checksum) return false;
  return ChecksumFits(AsText(request.first(request.size() - 1)), kChecksum);
}

void Identification::Begin() {
  done_ = false;
  step_ = 0;
  answered_ = false;
}

void Identification::OnAnswer(const Question& question, const DecodedReply& reply) {
  if (question.command == kAskMask) {
    asked_mask_ = true;
    const auto* mask = reply.outcome == Outcome::ok && !reply.fields.empty()
                           ? std::get_if<std::uint64_t>(&reply.fields.front().value)
                           : nullptr;
    if (mask != nullptr) mask_ = static_cast<std::uint32_t>(*mask);
    return Sum();
  }
  if (const auto input = InputOfQuestion(question.command)) {
    channels_.OnAnswer(*input, reply);
    return Sum();
  }
  answered_ = true;
  if (question.other_mode) {
    const bool on = !settings_.checksum;
    mode_ = ModuleChecksum(on);
    Sum();
    done_ = true;
    return;
  }
  OnPolled();
  if (question.command == kAskName && reply.outcome == Outcome::ok && !reply.fields.empty()) {
    name_ = JudgeName(device_.identity, ToText(reply.fields.front().value));
  }
  if (question.command == kAskType && reply.outcome == Outcome::ok && !reply.fields.empty()) {
    kind_ = Judge(ToText(reply.fields.front().value));
  }
  Sum();
  Advance(question);
}

void Identification::OnNothing(const Question& question, bool strange) {
  if (question.command == kAskMask) {
    asked_mask_ = true;
    return;
  }
  if (const auto input = InputOfQuestion(question.command)) {
    channels_.OnNothing(*input);
    return Sum();
  }
  answered_ = answered_ || (strange && !question.other_mode);
  Advance(question);
}

void Identification::Advance(const Question& question) {
  if (done_ || kRound[static_cast<std::size_t>(step_)] != question) return;
  ++step_;
  done_ = step_ == static_cast<int>(kRound.size()) || (answered_ && step_ >= kOwnMode);
  if (IsMute()) Sum();
}

void Identification::OnPolled() {
  sure_ = true;
  mode_ = {};
  Sum();
}

/// Asks the questions again after a lost poll, but only if the module has reported its type before.
/// Otherwise a module that never reports its type would be asked after every lost poll.
void Identification::OnLost() {
  if (type_) OnReconnect();
}

void Identification::OnReconnect() {
  Begin();
  asked_mask_ = false;
  sure_ = false;
  channels_.Forget();
}

/// Judges the reply to `$AA2` (type, bit rate, format byte). Example: "080600" is type 08, 9600
/// bit/s, format byte 00.
DeviceTrouble Identification::Judge(std::string_view configuration) {
  const auto type = ParseInteger<std::uint8_t>(configuration.substr(0, 2), 16);
  const auto format = ParseInteger<std::uint8_t>(configuration.substr(4), 16);
  if (!type || !format) return {};
  type_ = type;
  if (device_.identity.ignore) return {};
  const std::string code = HexByte(*type);
  const bool listed = std::ranges::any_of(settings_.types, [&](const std::string& listed_type) {
    return ParseInteger<unsigned>(listed_type, 16) == unsigned{*type};
  });
  if (!settings_.types.empty() && !listed) {
    return Complaint("it has type " + code + ", but the profile has " +
                     Alternatives(settings_.types));
  }
  // A module that was started with INIT* grounded answers at 00 without a checksum, whatever its
  // format byte is.
  const bool init = ParseAddress(device_.address).value() == 0;
  if (!init && ((*format & 0x40U) != 0) != settings_.checksum) {
    return ModuleChecksum(!settings_.checksum);
  }
  for (const config::Point& point : device_.points) {
    const auto read = ParseRead(point.read);
    if (point.access == config::Access::write || !read || read->command == "$3") continue;
    if (read->command == kAskSample && IsAnalogOutput(*type)) {
      return Complaint(
          "type " + code +
          " is an analog output, and $AA4 would store its present output for power-up; remove the "
          "points that read $4");
    }
    if (IsNumber(read->form) && (*format & 3U) != static_cast<unsigned>(settings_.format)) {
      return Complaint("its data format is '" + std::string(WordOf(*format)) +
                       "', but the profile has " +
                       std::string(WordOf(static_cast<unsigned>(settings_.format))));
    }
    if (!settings_.channel_types && !Measures(*type, *read, point.unit, settings_)) {
      return Complaint("type " + code + " measures in " + WhatOf(*type) + ", but the profile has " +
                       (read->total ? "a total" : point.unit) + " for " + point.name);
    }
  }
  return {};
}

bool Identification::IsMute() const {
  return done_ && !answered_ && !sure_ && settings_.checksum && only_others_;
}

/// Sets trouble_ to the most serious trouble: wrong checksum mode, then wrong type, then wrong
/// name. Without a trouble, the text of trouble_ lists the remarks for the status.
void Identification::Sum() {
  const bool was_wrong = static_cast<bool>(trouble_);
  trouble_ = mode_ ? mode_ : kind_ ? kind_ : name_;
  if (trouble_) return;
  if (IsMute()) {
    trouble_.text =
        "the module does not report its checksum mode ($AAM, $AA2), so writes are not sent; set "
        "identify: false if you know that its checksum is on";
  }
  if (was_wrong) {
    // The channels may have been changed while the trouble lasted, so the channel mask and the
    // types of the inputs are asked again.
    asked_mask_ = false;
    channels_.Forget();
  }
  const std::string remark = channels_.Remark(mask_.value_or(settings_.enabled));
  if (remark.empty()) return;
  if (!trouble_.text.empty()) trouble_.text += "; ";
  trouble_.text += remark + kAdviceOnInputs;
}

std::optional<double> Identification::FactorOf(std::size_t point) const {
  if (settings_.channel_types) return channels_.FactorOf(point);
  if (!type_ || settings_.format != Format::engineering) return 1;
  return FactorOfType(*type_, device_.points[point].unit).value_or(1);
}

namespace {

/// The maximum number of questions in one task. Five more exchanges can be necessary: two
/// broadcasts and three reads of a counter.
constexpr int kMostQuestions = kMostSteps - 5;

}  // namespace

std::optional<Questions::Question> Questions::TakeAsked() {
  return std::exchange(asked_, std::nullopt);
}

std::optional<Questions::Question> Questions::Before(std::string_view command) {
  asked_ = identification_.Next(command);
  if (!asked_) count_ = 0;
  return asked_;
}

bool Questions::ForgetAnew() { return std::exchange(anew_, std::nullopt).has_value(); }

/// Decides whether the question for an input's type follows the read of a task. The read goes
/// first, because the gateway makes sure only before the first request of a task that no late reply
/// can be taken for its reply. The reply to the question contains the module's address, so it may
/// come second.
Then Questions::AfterRead(std::string_view command, Instant now) {
  anew_.reset();
  if (count_ < kMostQuestions) anew_ = identification_.NextAnew(command, now);
  count_ = anew_ ? count_ + 1 : 0;
  return anew_ ? Then::ask_again : Then::done;
}

Then Questions::AfterQuestion(std::string_view command) {
  const bool goes_on = !identification_.is_done() || identification_.Allows(command);
  // A task has a limited number of exchanges, so the next poll continues with the questions.
  const bool enough = ++count_ >= kMostQuestions && goes_on && identification_.Next(command);
  if (goes_on && !enough) return Then::ask_again;
  count_ = 0;
  return enough ? Then::replan : Then::done;
}

void Questions::OnReconnect() {
  asked_.reset();
  anew_.reset();
  count_ = 0;
}

}  // namespace baudgate::protocols::dcon
