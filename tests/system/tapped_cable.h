// `TappedCable` is a cable that records all bytes from daemon to simulated device. For protocols
// whose requests end with a carriage return.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gateway/tools/simulate/pty.h"

namespace baudgate::system_test {

class TappedCable {
 public:
  /// `near` is the link that the daemon opens, `far` the simulated device's link.
  TappedCable(const std::string& near, const std::string& far);
  ~TappedCable();
  TappedCable(const TappedCable&) = delete;
  TappedCable& operator=(const TappedCable&) = delete;

  bool connected() const { return twin_ >= 0 && pty_.has_value(); }
  std::vector<std::string> Requests() const;

 private:
  void Carry();

  std::optional<tools::Pty> pty_;
  int twin_ = -1;
  mutable std::mutex mutex_;
  std::string heard_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate::system_test
