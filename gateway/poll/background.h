// What can wait, as a load profile that is read back: asked for when nothing else of the line is
// due before it would be through, so that no poll is later for it. On a line that is never idle for
// so long it is asked for once a minute all the same. Of several devices the one goes first that
// has waited longest.
//
//   polls due at 1.0 s and 2.0 s, room 400 ms      taken at 1.1 s; not at 1.7 s
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/poll/schedule.h"

namespace baudgate {

class Background {
 public:
  static constexpr Duration kLongest = std::chrono::minutes(1);
  enum class Which : std::uint8_t { that_fits, that_starves };

  /// `schedule` outlives it.
  explicit Background(const Schedule& schedule) : schedule_(schedule) {}

  /// Wanted from `due` on; nothing: not at all. `room`: how long an exchange may take, before it is
  /// known how long the last one took.
  void Set(std::size_t device, std::optional<Instant> due, Duration room);
  /// What it has brought last is not kept yet: nothing before Release.
  void Hold(std::size_t device) { At(device).held = true; }
  void Release(std::size_t device) { At(device).held = false; }

  std::optional<std::size_t> Next(Which which, Instant now) const;
  void OnTaken(std::size_t device, Instant now);
  /// The exchange took so long; zero: it was not answered. Long ones are remembered for a while:
  /// the next may be as long.
  void OnEnd(std::size_t device, Duration took);
  /// When Next may have something although nothing happens meanwhile. May lie in the past.
  std::optional<Instant> NextAt(Instant now) const;

 private:
  struct Item {
    std::optional<Instant> due;
    Instant taken{};  // last
    Duration room{};
    Duration took{};  // a long exchange; zero: nobody knows
    std::uint64_t turn = 0;
    bool held = false;
  };

  Item& At(std::size_t device);
  /// From when on it may be asked; nothing: not before something else happens.
  std::optional<Instant> MayBegin(std::size_t device) const;
  Instant Starves(const Item& item) const;
  bool Fits(const Item& item, Instant at) const;

  const Schedule& schedule_;
  std::vector<Item> items_;
  std::uint64_t turn_ = 0;
};

}  // namespace baudgate
