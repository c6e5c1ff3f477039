// The interface for viewers of the bytes of one line, with direction, time and the end of every
// exchange: the trace and the flight recorder. Fed by gateway/bus/poller/poller.h with what is left
// after the echo filter.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate {

/// Slaves that only transparent routes reach stand in no store: they are numbered by their address
/// from here on.
inline constexpr std::uint32_t kFirstSlave = 0x8000'0000;
inline std::string SlaveName(std::uint32_t device) {
  return "slave-" + std::to_string(device - kFirstSlave);
}

/// All calls come on the line's thread and must not block. Bytes are valid during the call only.
/// `device` is an index in the point store, or kFirstSlave and an address.
class Tap {
 public:
  virtual ~Tap() = default;
  /// Nothing of `request.expect.secrets` may leave the tap.
  virtual void OnSent(std::uint32_t device, const Request& request, Now now) = 0;
  virtual void OnReceived(View bytes, Now now) = 0;
  /// `end.outcome` and `end.reason` are final: the conversation has judged the frame.
  virtual void OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) = 0;
  virtual void OnDeviceState(std::uint32_t device, DeviceState to, const std::string& reason,
                             Now now) = 0;
};

}  // namespace baudgate
