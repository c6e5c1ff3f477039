// Compares what comes back with what was sent, byte by byte, and holds back what is equal.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/echo.h"

#include <algorithm>
#include <utility>

namespace baudgate {

void EchoFilter::OnSent(View request) {
  if (!differs_) Append(expected_, request);
}

EchoResult EchoFilter::Filter(View received) {
  EchoResult result;
  std::size_t used = 0;
  if (!differs_) {
    const bool was_pending = matched_ < expected_.size();
    while (used < received.size() && matched_ < expected_.size() &&
           received[used] == expected_[matched_]) {
      ++used;
      ++matched_;
    }
    result.complete = was_pending && matched_ == expected_.size();
    if (used < received.size() && matched_ < expected_.size()) {
      differs_ = true;
      if (!passes()) Append(result.bytes, View(expected_).first(matched_));
      matched_ = 0;
      result.collision = mode_ == config::Echo::verify;
    }
  }
  Append(result.bytes, passes() ? received : received.subspan(used));
  return result;
}

EchoResult EchoFilter::OnExchangeEnd() {
  EchoResult result;
  if (!differs_ && matched_ < expected_.size()) {
    if (!passes()) Append(result.bytes, View(expected_).first(matched_));
    result.collision = mode_ == config::Echo::verify;
  }
  expected_.clear();
  matched_ = 0;
  differs_ = false;
  return result;
}

void EchoWatch::OnSent(View request) {
  filter_.OnSent(request);
  echoed_ = false;
}

EchoWatch::Received EchoWatch::OnReceived(View bytes, const Request* asked) {
  EchoResult result = filter_.Filter(bytes);
  Received heard;
  heard.bytes = std::move(result.bytes);
  if (mode_ == config::Echo::off) {
    // What equals its request may as well be the reply.
    heard.echo = result.complete && asked != nullptr && !asked->expect.mirrors;
    if (!heard.echo) return heard;
    echoes_ = echoed_ = true;
    if (!std::exchange(told_echo_, true)) {
      heard.warning =
          "the request itself came back: this bus or its adapter echoes; set 'echo: strip' at the "
          "line";
    }
    return heard;
  }
  if (result.complete && mode_ == config::Echo::verify) {
    has_echoed_ = true;
    unechoed_ = 0;
  }
  heard.collision = result.collision;
  if (heard.collision && asked != nullptr && !std::exchange(told_collision_, true)) {
    heard.warning =
        "the echo is missing or differs from what was sent: two talkers at once, or a bus that "
        "does not echo (echo: off)";
  }
  return heard;
}

bool EchoWatch::MayBeEcho(const Request& request, View frame) const {
  return echoes_ && request.expect.mirrors && std::ranges::equal(frame, request.bytes);
}

bool EchoWatch::OnExchangeEnd(const Request& request, ExchangeEnd& end) {
  const EchoResult rest = filter_.OnExchangeEnd();
  if (ProvesLife(end.outcome) && !request.expect.mirrors && !echoed_) echoes_ = false;
  const bool asked = request.expect.reply == Expectation::Reply::one;
  if (!rest.collision || !asked || end.outcome == Outcome::line_down) return false;
  unechoed_ = rest.bytes.empty() ? unechoed_ + 1 : 0;
  end.reason = rest.bytes.empty() ? "no reply, and not even the echo of the request"
                                  : "the echo of the request broke off";
  return true;
}

}  // namespace baudgate
