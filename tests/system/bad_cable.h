// `BadCable` is a cable between daemon and simulated device that fragments, delays and damages
// replies. Requests pass unchanged. The daemon opens its pty; a thread carries the bytes to and
// from the simulated device's pty.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "gateway/base/bytes.h"
#include "gateway/tools/simulate/pty.h"

namespace baudgate::system_test {

class BadCable {
 public:
  /// `near` is the link that the daemon opens, `far` the simulated device's. The damage depends on
  /// `seed`.
  BadCable(const std::string& near, const std::string& far, std::uint32_t seed);
  ~BadCable();
  BadCable(const BadCable&) = delete;
  BadCable& operator=(const BadCable&) = delete;

  bool connected() const { return twin_ >= 0 && pty_.has_value(); }
  /// While noisy, random bytes arrive, a byte of some replies is changed, and some replies are cut.
  void SetNoisy(bool noisy) { noisy_ = noisy; }
  std::size_t noise_bytes() const { return noise_bytes_; }

 private:
  void Carry();
  void CarryReply(View whole);
  void Damage(Bytes& reply);
  void MakeNoise();
  int Random(int low, int high);

  std::mt19937 random_;
  std::optional<tools::Pty> pty_;
  int twin_ = -1;
  std::atomic<bool> noisy_ = false;
  std::atomic<bool> stop_ = false;
  std::atomic<std::size_t> noise_bytes_ = 0;
  std::thread thread_;
};

}  // namespace baudgate::system_test
