// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/alarm_sender.h"

namespace baudgate::dds {
namespace {

constexpr std::size_t kAlarmsAtATime = 64;

}  // namespace

void AlarmSender::StartAnew() {
  version_ = 0;
  batch_.clear();
  next_ = 0;
}

const AlarmSample* AlarmSender::Next() {
  if (supply_ == nullptr) return nullptr;
  if (next_ == batch_.size()) {
    batch_ = supply_->TakeAlarms(version_, kAlarmsAtATime);
    next_ = 0;
  }
  return batch_.empty() ? nullptr : &batch_[next_].sample;
}

void AlarmSender::OnSent() {
  version_ = batch_[next_].version;
  ++next_;
}

}  // namespace baudgate::dds
