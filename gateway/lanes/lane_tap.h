// What one lane tells the recorder of its line, exchange by exchange: those of other lanes take
// place at the same time, and a reply belongs behind its request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gateway/trace/tap.h"

namespace baudgate {

class LaneTap final : public Tap {
 public:
  void Attach(Tap& tap) { tap_ = &tap; }

  /// What has been heard so far of an exchange that has no end.
  void Flush();

  void OnSent(std::uint32_t device, const Request& request, Now now) override;
  void OnReceived(View bytes, Now now) override;
  void OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) override;
  void OnDeviceState(std::uint32_t device, DeviceState to, const std::string& reason,
                     Now now) override;

 private:
  Tap* tap_ = nullptr;
  bool asking_ = false;
  std::uint32_t device_ = 0;
  Request request_;
  Now sent_{};
  std::vector<std::pair<Bytes, Now>> received_;
};

}  // namespace baudgate
