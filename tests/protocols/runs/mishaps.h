// Mishaps decides which faults happen in a run, and when. The decisions depend only on the seed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <utility>

#include "tests/protocols/runs/bad_wire.h"

namespace baudgate::protocols {

struct Troubles {
  unsigned wire_one_in = 0;  ///< one in this many replies is damaged or lost
  unsigned late_one_in = 0;  ///< one in this many replies comes after the timeout
  bool kills = false;
  bool power_cuts = false;
};

class Mishaps {
 public:
  Mishaps(unsigned seed, Troubles troubles) : random_(seed), troubles_(troubles) {}

  void End() { troubles_ = {}; }

  std::mt19937& random() { return random_; }
  unsigned Below(unsigned count) { return static_cast<unsigned>(random_() % count); }
  bool OneIn(unsigned count) { return count > 0 && random_() % count == 0; }

  bool StrikesWire() { return OneIn(troubles_.wire_one_in); }
  bool StrikesLate() { return OneIn(troubles_.late_one_in); }
  Bytes Carry(Bytes reply) { return StrikesWire() ? Spoiled(std::move(reply), random_) : reply; }
  bool Kills(unsigned one_in) { return troubles_.kills && OneIn(one_in); }
  /// Number of disk writes until the power fails; see EventKeeper::Begin.
  int PowerLeft(unsigned most) {
    return troubles_.power_cuts ? static_cast<int>(1 + Below(most)) : -1;
  }

 private:
  std::mt19937 random_;
  Troubles troubles_;
};

}  // namespace baudgate::protocols
