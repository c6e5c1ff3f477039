// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/lost_replies.h"

namespace baudgate {

void LostReplies::OnLost(const Member& slave, const Bytes& request, Instant now) {
  State& state = states_[slave];
  if (!MayCome(slave, now)) state.requests.clear();
  if (state.requests.size() == kMost) state.requests.erase(state.requests.begin());
  state.requests.push_back(request);
  state.lost_at = now;
}

bool LostReplies::MayCome(const Member& slave, Instant began) const {
  const std::optional<Instant>& lost_at = states_[slave].lost_at;
  return lost_at && began - *lost_at <= kLatest;
}

LostReplies::Older LostReplies::MayBe(const Member& slave, const Bytes& request, Instant began,
                                      const MayFit& fits) const {
  Older older;
  if (!MayCome(slave, began)) return older;
  for (const Bytes& lost : states_[slave].requests) {
    const bool same = lost == request;
    older.same = older.same || same;
    older.other = older.other || (!same && fits(lost));
  }
  return older;
}

bool LostReplies::OnReply(const Member& slave, const Bytes& request, Older older,
                          std::size_t count) {
  std::vector<Bytes>& lost = states_[slave].requests;
  if ((!older.other && !older.same) || count > lost.size()) {
    lost.clear();
    return true;
  }
  // One of those that were owed has come; that to this request may still be.
  lost.erase(lost.begin());
  lost.push_back(request);
  return !older.other;
}

}  // namespace baudgate
