// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/identification.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/common/designation.h"
#include "protocols/dcon/broadcasts.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/type_codes.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::array<Identification::Question, 4> kRound = {
    {{kAskName, false}, {kAskType, false}, {kAskName, true}, {kAskType, true}}};
constexpr int kOwnMode = 2;  // questions of the round

constexpr std::string_view kAdvice = ": correct the profile, the address or the module";

constexpr const char* kAdviceOnInputs =
    " (bad until then: correct the unit, the input's type or its wiring)";

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
          "the module is not what its profile says: " + std::move(what).append(kAdvice)};
}

/// `on`: in the module.
DeviceTrouble ModuleChecksum(bool on) {
  return {Reason::other_module,
          std::string("the module's checksum is ") + (on ? "on" : "off") +
              ", and the configuration says checksum: " + (on ? "false" : "true") +
              ": set checksum: " + (on ? "true" : "false") + " in the configuration"};
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

/// `#AA` and `#AAN` alone: with a checksum that is not due, `#0184` is a read of channel 84 at
/// most.
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

/// One that tells nothing of itself is not asked again and again.
void Identification::OnLost() {
  if (type_) OnReconnect();
}

void Identification::OnReconnect() {
  Begin();
  asked_mask_ = false;
  sure_ = false;
  channels_.Forget();
}

/// "080600": type 08, 9600 bit/s, format byte 00.
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
    return Complaint("type " + code + ", the profile says " + Alternatives(settings_.types));
  }
  // With INIT* grounded a module answers at 00 without checksum, whatever is set.
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
          " is an analog output, and $AA4 would store its present output for power-up");
    }
    if (IsNumber(read->form) && (*format & 3U) != static_cast<unsigned>(settings_.format)) {
      return Complaint("data format '" + std::string(WordOf(*format)) + "', the profile says " +
                       std::string(WordOf(static_cast<unsigned>(settings_.format))));
    }
    if (!settings_.channel_types && !Measures(*type, *read, point.unit, settings_)) {
      return Complaint("type " + code + " measures in " + WhatOf(*type) + ", the profile says " +
                       (read->total ? "a total" : point.unit) + " for " + point.name);
    }
  }
  return {};
}

bool Identification::IsMute() const {
  return done_ && !answered_ && !sure_ && settings_.checksum && only_others_;
}

/// The worst of all that the module has said; of remarks all.
void Identification::Sum() {
  const bool was_wrong = static_cast<bool>(trouble_);
  trouble_ = mode_ ? mode_ : kind_ ? kind_ : name_;
  if (trouble_) return;
  if (IsMute()) {
    trouble_.text =
        "it does not say in which checksum mode it is ($AAM, $AA2), so writes are not sent: set "
        "identify: false if its checksum is on";
  }
  if (was_wrong) {
    // Meanwhile channels may have been set as well.
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

}  // namespace baudgate::protocols::dcon
