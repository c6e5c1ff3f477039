// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/reply_echo.h"

#include <algorithm>

namespace baudgate::modbus {

void ReplyEcho::OnSent(View request, View reply, Instant earliest) {
  filter_.OnExchangeEnd();
  filter_.OnSent(reply);
  mirrored_ = std::ranges::equal(request, reply);
  earliest_ = earliest;
  heard_ = 0;
}

Bytes ReplyEcho::Filter(View received, Instant now) {
  const bool first = heard_ == 0;
  const bool no_echo = echoes_ == Echoes::no || (echoes_ == Echoes::unknown && now >= earliest_);
  if (mirrored_ && first && no_echo) filter_.OnExchangeEnd();
  heard_ += received.size();
  EchoResult result = filter_.Filter(received);
  if (result.complete && !mirrored_) echoes_ = Echoes::yes;
  return std::move(result.bytes);
}

void ReplyEcho::OnRequest(std::size_t size) {
  if (!mirrored_ && heard_ == size) echoes_ = Echoes::no;
}

}  // namespace baudgate::modbus
