// How much of the log each thing that happens may take: what flaps must not crowd out the others.
// Twenty at once, then one a minute. What is beyond is left out, but for the last, so that what the
// log says in the end is how it is: told in its minute, or as soon as it has settled, which takes
// two seconds, and twice as long each time. Kept are events of one code of one device, port or
// point.
//
//   61 x tripped, reset within seconds     20 of them
//   2 s later                              "40 events like the next left out", and the last
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/events/event_record.h"

namespace baudgate::events {

class Shares {
 public:
  static constexpr int kAtOnce = 20;
  static constexpr Duration kEach = std::chrono::minutes(1);
  static constexpr Duration kSettles = std::chrono::seconds(2);

  /// False: it is left out. `room`: there is some for anybody.
  bool Take(const EventRecord& record, bool room, Instant now);
  /// One that was taken is on the disk: of each so many wait at most.
  void OnKept(const EventRecord& record);
  /// What may be told by now of those that were left out: how many, then the last of them. `all`:
  /// it is now or never.
  std::vector<EventRecord> TakeLeftOut(Now now, bool all = false);
  /// When there may be some; nothing: none was left out.
  std::optional<Instant> NextAt() const;

  std::uint64_t left_out() const { return left_out_; }  ///< since the start

 private:
  using Key = std::tuple<std::string, std::string, std::uint32_t, std::string>;
  struct Share {
    int left = kAtOnce;
    Instant filled{};  ///< when `left` last became more
    int waiting = 0;   ///< for the disk
    std::uint64_t left_out = 0;
    WallTime since{};  ///< of the first of them
    EventRecord last{};
    Instant last_at{};
    Duration settles = kSettles;

    Instant SettledAt() const { return last_at + settles; }
  };
  static Key KeyOf(const EventRecord& record);
  static void Fill(Share& share, Instant now);

  std::map<Key, Share> shares_;  // bounded by the configuration
  std::uint64_t left_out_ = 0;
};

}  // namespace baudgate::events
