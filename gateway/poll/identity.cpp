// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/identity.h"

#include <algorithm>

namespace baudgate {
namespace {

/// A device that has been replaced by one of another kind is believed after so many probes. Needed
/// by ReplacedDevice.IsBelievedAfterAWhile: a relay whose successor says that it is another type.
constexpr int kProbesOfAnother = 16;

/// So many answered probes of another kind, and none to the identification, end it. Needed by
/// MisbehavingTwin.AWrongAddressIsUnexpectedWhereTheReplyCarriesOne/Dcon9600: what identified the
/// device is refused for ever afterwards.
constexpr int kOtherProbes = 3;

/// A line feed behind the carriage return may be missing, or come with the next bytes.
View WithoutLineEnd(View frame) {
  while (!frame.empty() && (frame.back() == '\r' || frame.back() == '\n')) {
    frame = frame.first(frame.size() - 1);
  }
  return frame;
}

}  // namespace

void Identity::Learn(const Request& probe, View reply) {
  const View frame = WithoutLineEnd(reply);
  request_ = probe.bytes;
  reply_.assign(frame.begin(), frame.end());
}

void Identity::OnProbeAnswered(const Request& probe) {
  other_probes_ = IsAskedBy(probe) ? 0 : other_probes_ + 1;
  if (other_probes_ < kOtherProbes) return;
  request_.clear();
  reply_.clear();
}

bool Identity::Matches(const Request& request, View reply, Outcome outcome) {
  const View frame = WithoutLineEnd(reply);
  const bool same = std::ranges::equal(frame, reply_);
  if (!IsAskedBy(request)) return same;
  if (!same && !ProvesLife(outcome)) {
    other_seen_ = 0;  // no identification at all: the order is wrong, not the device
    return false;
  }
  const bool ok = outcome == Outcome::ok;
  const bool another = ok && !std::ranges::equal(frame, other_reply_);
  if (same || another) other_seen_ = 0;
  if (same) return true;
  if (ok) other_reply_.assign(frame.begin(), frame.end());
  if (++other_seen_ < kProbesOfAnother) return false;
  // It has been replaced, or does not identify itself any more.
  reply_ = ok ? other_reply_ : Bytes();
  if (!ok) request_.clear();
  other_seen_ = 0;
  return true;
}

}  // namespace baudgate
