// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial/reply_echo.h"

#include <algorithm>

namespace baudgate::modbus {

void ReplyEcho::OnSent(View request, View reply, Instant earliest) {
  teaches_ = !std::ranges::equal(request, reply);
  filter_.OnExchangeEnd();
  owed_.clear();
  if (teaches_) {
    filter_.OnSent(reply);
  } else {
    Append(owed_, reply);
  }
  earliest_ = earliest;
  heard_ = 0;
}

Bytes ReplyEcho::Filter(View received, Instant now) {
  if (heard_ == 0) began_ = now;
  heard_ += received.size();
  EchoResult result = filter_.Filter(received);
  if (result.complete && teaches_) echoes_ = Echoes::yes;
  return std::move(result.bytes);
}

/// What begins too early for the master was on its way before the reply was: its echo may still
/// come.
ReplyEcho::Heard ReplyEcho::OnRequest(View frame) {
  const bool early = began_ < earliest_;
  if (teaches_ && heard_ == frame.size() && !early) echoes_ = Echoes::no;
  if (owed_.empty() || !std::ranges::equal(owed_, frame)) return Heard::request;
  owed_.clear();
  if (echoes_ == Echoes::no) return Heard::request;
  return echoes_ == Echoes::yes || early ? Heard::echo : Heard::doubt;
}

}  // namespace baudgate::modbus
