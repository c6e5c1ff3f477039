// How many events of one kind are kept: a kind is one code of one device, port or point. One that
// flaps must not crowd out the others. Twenty at once, then one a minute. The rest is left out,
// except the last one, so that the log ends with the present state: it is kept in its minute, or as
// soon as the state has settled, which takes two seconds, and twice as long each time.
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
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

class Shares {
 public:
  static constexpr int kAtOnce = 20;
  static constexpr Duration kEach = std::chrono::minutes(1);
  static constexpr Duration kSettles = std::chrono::seconds(2);

  /// False: it is left out. `room`: whether there is room at all.
  bool Take(const EventRecord& record, bool room, Instant now);
  /// One that was taken is on the disk: the number of each kind that may wait is limited.
  void OnKept(const EventRecord& record);
  /// Returns what may be kept by now of those that were left out: their number, then the last of
  /// them. `all`: at the end of the program.
  std::vector<EventRecord> TakeLeftOut(Now now, bool all = false);
  /// When there may be some; empty: none was left out.
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
