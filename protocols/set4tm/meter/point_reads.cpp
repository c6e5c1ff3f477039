// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/point_reads.h"

#include <algorithm>

#include "protocols/set4tm/meter/latch.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {

PointReads::PointReads(const config::Device& device, const Settings& settings,
                       const Identification& identification)
    : settings_(settings),
      identification_(identification),
      fields_(device.points),
      is_often_(OftenOf(device)),
      plan_(fields_.MakePlan(false, is_often_)) {}

void PointReads::OnReconnect() {
  integers_ = false;
  fields_.UseIntegers(false);
  UseMasks(settings_.snapshot == Snapshot::on);
  TryMasks();
}

bool PointReads::MasksMayHelp() const {
  if (masked_ || settings_.snapshot == Snapshot::off) return false;
  return fields_.MakePlan(true).queries().size() < plan_.queries().size();
}

void PointReads::UseMasks(bool masked) {
  masked_ = masked;
  tries_masks_ = false;
  PduPlan plan = fields_.MakePlan(masked, is_often_);
  plan.TakeProven(plan_);
  plan_ = std::move(plan);
}

bool PointReads::ChooseIntegers() {
  const bool integers = identification_.floats() == Knows::no && !identification_.trouble();
  if (integers == integers_ || !(integers_ || fields_.HasFloats())) return false;
  integers_ = integers;
  fields_.UseIntegers(integers);
  UseMasks(!integers && settings_.snapshot == Snapshot::on);
  tries_masks_ = !integers && MasksMayHelp();
  return true;
}

std::optional<Bytes> PointReads::Trial(std::size_t query) const {
  if (!tries_masks_ || identification_.masked_floats() == Knows::no) return std::nullopt;
  if (!IsFloatRead(fields_.PduOf(plan_, query))) return std::nullopt;
  const std::size_t point = plan_.queries()[query].points.front();
  const PduPlan masked = fields_.MakePlan(true);
  for (std::size_t i = 0; i < masked.queries().size(); ++i) {
    if (std::ranges::count(masked.queries()[i].points, point) == 0) continue;
    Bytes pdu = fields_.PduOf(masked, i);
    return IsMasked(pdu) ? std::optional(std::move(pdu)) : std::nullopt;
  }
  return std::nullopt;
}

PointReads::Read PointReads::ReadOf(std::size_t query) const {
  if (auto trial = Trial(query)) return {.pdu = std::move(*trial), .tries_masks = true};
  return {.pdu = fields_.PduOf(plan_, query)};
}

void PointReads::Number(Bytes& pdu) {
  if (IsMasked(pdu)) pdu[2] = ++number_;
}

bool PointReads::Reads(View pdu, std::size_t query) const {
  const Bytes own = fields_.PduOf(plan_, query);
  return Is(pdu, own) || (IsMasked(pdu) && IsMasked(own));
}

bool PointReads::ReadsLatched(std::size_t query) const {
  return set4tm::ReadsLatched(fields_.PduOf(plan_, query));
}

/// What it does not give so, it may give by 08 1B.
Answer PointReads::TakeTrial(Answer answer) {
  const bool whole = std::ranges::all_of(
      answer.readings, [](const Reading& reading) { return IsGood(reading.quality); });
  tries_masks_ = false;
  if (!whole) return AskAgain();
  UseMasks(true);
  answer.then = Then::restart;
  return answer;
}

bool PointReads::ForgetRefusals() {
  TryMasks();
  return plan_.ForgetRefusals();
}

std::string PointReads::Learned() const {
  if (masked_) return "floats together (08 23)";
  return integers_ ? "integers in place of floats, which its type does not have" : "";
}

}  // namespace baudgate::protocols::set4tm
