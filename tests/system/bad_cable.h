// A bad cable between the daemon and a twin, for tests: tears replies apart, delays the pieces,
// changes and loses some bytes and adds others. Requests pass unharmed. A pty on the daemon's side,
// the twin's pty on the other.
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
  /// `near` is what the daemon opens, `far` the twin's link. The same seed does the same damage to
  /// the same bytes.
  BadCable(const std::string& near, const std::string& far, std::uint32_t seed);
  ~BadCable();
  BadCable(const BadCable&) = delete;
  BadCable& operator=(const BadCable&) = delete;

  bool connected() const { return twin_ >= 0 && pty_.has_value(); }
  /// While it is noisy, random bytes come at random times, before replies and without any, one byte
  /// of some replies is another, and the rest of some is lost.
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
