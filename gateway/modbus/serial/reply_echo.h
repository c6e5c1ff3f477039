// Knows our own replies in what a two-wire adapter hears, on the side of the slave: the reply to a
// write of one register equals its request, and answering it would never end. Sans-I/O; bytes come
// from serial_listener.cpp and go back to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/line/echo_filter.h"

namespace baudgate::modbus {

/// Whether the adapter echoes is learned from replies that can not be requests: what comes first
/// after them is either their echo or the master's next request. Nothing else teaches it. A time
/// that has passed does not, for nobody knows how late adapter, driver and a busy machine are.
///
/// A reply that equals its request owes one echo, which is the first frame like it, whatever was
/// heard before. That frame is
///  * passed over where the adapter is known to echo, or when it begins before the master can have
///    begun a request;
///  * a request where the adapter is known not to echo;
///  * else in doubt, and neither carried out nor passed over in silence: the answer "busy" is no
///    request, so its own echo, or that there is none, ends the doubt. A master repeats its write;
///    an echo can not answer, so nothing goes on for ever, even when the busy answer is lost or
///    damaged and teaches nothing.
/// An echo that was damaged leaves its debt: the master's same write is then passed over, or found
/// busy, once.
class ReplyEcho {
 public:
  enum class Heard : std::uint8_t { request, echo, doubt };

  /// Another adapter, perhaps.
  void Reset() { *this = ReplyEcho(); }

  /// Before the reply goes out. `earliest`: no request of the master begins before.
  void OnSent(View request, View reply, Instant earliest);
  /// What is not the echo of a reply that can not be a request, in order.
  Bytes Filter(View received, Instant now);
  /// Bytes have arrived that look like the start of an echo.
  bool holding() const { return filter_.holding(); }
  /// The line has fallen silent: gives back what was held.
  Bytes OnSilence() { return filter_.OnExchangeEnd().bytes; }
  /// A whole request was among what Filter passed.
  Heard OnRequest(View frame);

 private:
  enum class Echoes : std::uint8_t { unknown, yes, no };

  EchoFilter filter_{config::Echo::strip};
  Echoes echoes_ = Echoes::unknown;
  bool teaches_ = false;  ///< the last reply can not be a request
  Bytes owed_;            ///< the last reply, if it can, until its echo was heard
  Instant earliest_ = Instant::min();
  Instant began_ = Instant::min();  ///< what was heard since the last reply
  std::size_t heard_ = 0;           ///< bytes of it
};

}  // namespace baudgate::modbus
