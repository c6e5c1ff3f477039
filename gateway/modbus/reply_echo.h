// Takes our own replies out of what a two-wire adapter hears, on the side of the slave: the reply
// to a write of one register equals its request, and answering it would never end. Sans-I/O; bytes
// come from serial_listener.cpp and go back to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "transports/echo_filter.h"

namespace baudgate::modbus {

/// Whether the adapter echoes at all is learned from replies that can not be requests: what comes
/// first after them is either their echo or the master's next request. While it is not known, the
/// same bytes as a reply that equals its request are its echo when they begin before the master can
/// have begun a request.
class ReplyEcho {
 public:
  /// Another adapter, perhaps.
  void Reset() { *this = ReplyEcho(); }

  /// Before the reply goes out. `earliest`: no request of the master begins before.
  void OnSent(View request, View reply, Instant earliest);
  /// What is not echo, in order.
  Bytes Filter(View received, Instant now);
  /// Bytes have arrived that look like the start of an echo.
  bool holding() const { return filter_.holding(); }
  /// The line has fallen silent: gives back what was held.
  Bytes OnSilence() { return filter_.OnExchangeEnd().bytes; }
  /// A whole request of so many bytes was among what Filter passed.
  void OnRequest(std::size_t size);

 private:
  enum class Echoes : std::uint8_t { unknown, yes, no };

  EchoFilter filter_{config::Echo::strip};
  Echoes echoes_ = Echoes::unknown;
  bool mirrored_ =
      true;  ///< the last reply equals its request, or there was none: nothing to learn
  Instant earliest_ = Instant::min();
  std::size_t heard_ = 0;  ///< bytes since the last reply
};

}  // namespace baudgate::modbus
