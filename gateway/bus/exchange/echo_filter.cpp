// Compares what comes back with what was sent, byte by byte, and holds back what is equal.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/echo_filter.h"

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

}  // namespace baudgate
