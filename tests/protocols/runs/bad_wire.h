// BadWire damages, loses and delays the replies of simulated devices, and records which replies
// were damaged. For runs in virtual time with the real protocols.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {

/// One in this many replies is damaged or lost. 0: none.
struct WireFaults {
  unsigned damaged_one_in = 3;
  unsigned lost_one_in = 0;
};

class BadWire {
 public:
  BadWire(Rig& rig, unsigned seed, WireFaults faults = {});
  void End();

  /// True if one of the latest replies of the device was damaged but has a valid check value. A
  /// reading can be stored only after the next reply, so several replies count.
  bool IsBeyondDetection(std::uint32_t device);

  std::size_t replies() const { return replies_; }
  std::size_t damaged() const { return damaged_; }
  std::size_t lost() const { return lost_; }
  std::size_t undetected() const { return undetected_; }

 private:
  struct Latest {
    Bytes request;
    Bytes arrived;
    bool damaged = false;
  };

  bool OneIn(unsigned count) { return count > 0 && random_() % count == 0; }
  Bytes Carry(std::uint32_t device, Bytes reply);
  Bytes Damage(Bytes reply);
  std::uint8_t Noise();
  Bytes Flip(Bytes reply, std::size_t from, std::size_t length, std::size_t count);

  Rig& rig_;
  WireFaults faults_;
  std::mt19937 random_;
  std::vector<std::deque<Latest>> latest_;  // latest replies of each device, the newest last
  static constexpr std::size_t kRemembered = 6;
  bool IsBeyondDetection(std::uint32_t device, const Latest& latest) const;
  Latest& Newest(std::uint32_t device) { return latest_[device].back(); }

  std::size_t replies_ = 0;
  std::size_t damaged_ = 0;
  std::size_t lost_ = 0;
  std::size_t undetected_ = 0;
};

/// Loses or truncates the reply, or flips one bit. Every checksum detects this damage.
Bytes Spoiled(Bytes reply, std::mt19937& random);

/// Returns RealLines(), and an SPA Bus line without parity, where only the weak XOR detects damage.
std::vector<Setup> DamagedLines();

}  // namespace baudgate::protocols
