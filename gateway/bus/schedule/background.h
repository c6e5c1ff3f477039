// Low-priority reads, such as load profiles: sent when they fit before the next poll is due, so no
// poll is delayed. On a line that is never idle for long enough, one is sent once a minute anyway.
// Among several devices the one that has waited longest goes first.
//
//   polls due at 1.0 s and 2.0 s, room 400 ms      taken at 1.1 s; not at 1.7 s
//
// From time to time a proof has to show whose replies come (gateway/bus/replies/whose_reply.h),
// which would delay a poll. If there is room, the proof goes with a background exchange before it
// is needed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/bus/schedule/schedule.h"

namespace baudgate {

class Background {
 public:
  static constexpr Duration kLongest = std::chrono::minutes(1);
  /// After a read that could not be sent.
  static constexpr Duration kPause = 1s;
  static constexpr int kFew = 8;
  enum class Which : std::uint8_t { that_fits, that_starves };

  /// `schedule` outlives it.
  explicit Background(const Schedule& schedule) : schedule_(schedule) {}

  /// Wanted from `due` on; empty: not at all. `room`: how long an exchange may take, until it is
  /// known how long the last one took.
  void Set(std::size_t device, std::optional<Instant> due, Duration room);
  /// From `may` on a proof may go with its exchange, from `must` on it must.
  void SetProof(std::size_t device, Instant may, Instant must);
  /// What it brought last is not on the disk yet: it has no turn before Release.
  void AwaitDisk(std::size_t device) { At(device).awaits_disk = true; }
  void Release(std::size_t device) { At(device).awaits_disk = false; }

  std::optional<std::size_t> Next(Which which, Instant now) const;
  void OnTaken(std::size_t device, Instant now);
  /// The exchange took `took`, its proof included; zero: it was not answered. Long ones are
  /// remembered for a while, because the next may be as long.
  void OnEnd(std::size_t device, Duration took, bool proved = false);
  /// Nothing was sent for it: it has no other turn at the same moment.
  void OnUnsent(std::size_t device) { items_[device].again = items_[device].taken + kPause; }
  /// Whether another exchange of the device would end before the next poll is due.
  bool HasRoom(std::size_t device, Instant now) const;
  /// The same with a proof, if one may go with it.
  bool MayProve(std::size_t device, Instant now) const;
  /// When Next may have something even if nothing else happens. May lie in the past.
  std::optional<Instant> NextAt(Instant now) const;

 private:
  /// The longest of the exchanges of one kind.
  struct Longest {
    Duration took{};
    int known = 0;  // exchanges
    void Learn(Duration took);
  };
  struct Item {
    std::optional<Instant> due;
    Instant taken{};  // last
    Instant again{};  // not before: it could not be sent
    Duration room{};
    Longest plain;
    Longest proved;
    Instant may_prove = Instant::max();
    Instant must_prove = Instant::max();
    std::uint64_t turn = 0;
    bool awaits_disk = false;
    bool lost = false;  // the last one: the next may be silent as well
  };

  Item& At(std::size_t device);
  /// From when on it may be asked; empty: not before something else happens.
  std::optional<Instant> MayBegin(std::size_t device) const;
  Instant Starves(const Item& item) const;
  bool Fits(const Item& item, Instant at) const;
  bool IsIdleFor(Duration room, Instant at) const;
  static Duration RoomOf(const Item& item);
  static Duration RoomToProve(const Item& item);

  const Schedule& schedule_;
  std::vector<Item> items_;
  std::uint64_t turn_ = 0;
};

}  // namespace baudgate
