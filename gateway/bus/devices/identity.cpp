// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/identity.h"

#include <algorithm>

namespace baudgate {
namespace {

/// A line feed after the carriage return may be missing, or come with the next bytes.
View WithoutLineEnd(View frame) {
  while (!frame.empty() && (frame.back() == '\r' || frame.back() == '\n')) {
    frame = frame.first(frame.size() - 1);
  }
  return frame;
}

}  // namespace

bool Identity::Is(View reply) const {
  return known() && std::ranges::equal(WithoutLineEnd(reply), reply_);
}

void Identity::Learn(const Bytes& request, View reply, Outcome outcome) {
  const View frame = WithoutLineEnd(reply);
  request_ = request;
  reply_.assign(frame.begin(), frame.end());
  names_ = outcome == Outcome::ok;
  other_.clear();
  certain_ = false;
}

bool Identity::OnOther(View reply) {
  const View frame = WithoutLineEnd(reply);
  if (std::ranges::equal(frame, other_)) return true;
  other_.assign(frame.begin(), frame.end());
  return false;
}

}  // namespace baudgate
