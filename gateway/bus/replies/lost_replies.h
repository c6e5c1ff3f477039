// Replies that never came from slaves that only routes reach. The order of their requests is not
// kept, so a reply that was only late may come in place of the reply to the next request. Used by
// gateway/bus/replies/whose_reply.h; docs/timeouts.md, "Requests of transparent routes".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/roster.h"

namespace baudgate {

class LostReplies {
 public:
  /// Which earlier, lost requests a reply could answer instead of the present one.
  struct Older {
    bool other = false;  ///< a request of other bytes
    bool same = false;   ///< an earlier one of the same bytes
  };

  /// There was no reply to `request`, or a damaged one.
  void OnLost(const Member& slave, const Bytes& request, Instant now);
  /// Whether a reply to a request that began at this time may be one of the lost ones.
  bool MayCome(const Member& slave, Instant began) const;
  /// Which lost requests this reply could answer; `fits`: whether it could answer one.
  using MayFit = std::function<bool(const Bytes& request)>;
  Older MayBe(const Member& slave, const Bytes& request, Instant began, const MayFit& fits) const;
  /// A reply came, the `count`-th in a row to the same request. False: it may belong to an earlier
  /// one. Example: two were lost, so the third reply to one request must be its own.
  bool OnReply(const Member& slave, const Bytes& request, Older older, std::size_t count);

 private:
  struct State {
    std::optional<Instant> lost_at;  // the latest
    std::vector<Bytes> requests;     // the latest
  };
  /// Assumed: no slave takes longer for a reply. One whose ceiling is longer is guarded for these 5
  /// s only. Needed by PollerRoutedFaults.ALateReplyOfAnotherFormIsNoOddReply.
  static constexpr Duration kLatest = 5s;
  static constexpr std::size_t kMost = 8;

  ByMember<State> states_;
};

}  // namespace baudgate
