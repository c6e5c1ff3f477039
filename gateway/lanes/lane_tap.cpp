// SPDX-License-Identifier: Apache-2.0
#include "gateway/lanes/lane_tap.h"

namespace baudgate {

void LaneTap::Flush() {
  if (tap_ == nullptr) return;
  if (std::exchange(asking_, false)) tap_->OnSent(device_, request_, sent_);
  for (const auto& [bytes, at] : std::exchange(received_, {})) tap_->OnReceived(bytes, at);
}

void LaneTap::OnSent(std::uint32_t device, const Request& request, Now now) {
  Flush();
  asking_ = true;
  device_ = device;
  request_ = request;
  sent_ = now;
}

void LaneTap::OnReceived(View bytes, Now now) {
  received_.emplace_back(Bytes(bytes.begin(), bytes.end()), now);
  if (!asking_) Flush();
}

void LaneTap::OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) {
  Flush();
  if (tap_ != nullptr) tap_->OnExchangeEnd(device, end, now);
}

void LaneTap::OnDeviceState(std::uint32_t device, DeviceState to, const std::string& reason,
                            Now now) {
  if (tap_ != nullptr) tap_->OnDeviceState(device, to, reason, now);
}

}  // namespace baudgate
