// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/serial/reply_echo.h"

#include <algorithm>
#include <utility>

namespace baudgate::modbus {

void ReplyEcho::OnSent(View reply, Instant until) {
  filter_.OnExchangeEnd();
  filter_.OnSent(reply);
  owed_.assign(reply.begin(), reply.end());
  until_ = until;
}

Bytes ReplyEcho::Filter(View received) {
  if (!strips_) return Bytes(received.begin(), received.end());
  EchoResult result = filter_.Filter(received);
  if (result.complete) owed_.clear();
  return std::move(result.bytes);
}

bool ReplyEcho::IsEcho(View frame, Instant ended) {
  const Bytes owed = std::exchange(owed_, {});
  return !owed.empty() && ended <= until_ && std::ranges::equal(owed, frame);
}

}  // namespace baudgate::modbus
