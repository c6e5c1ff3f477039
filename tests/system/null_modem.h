// `NullModem` is a crossed serial cable: two ptys, and a thread that carries and counts bytes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>

#include "gateway/tools/simulate/pty.h"

namespace baudgate::system_test {

class NullModem {
 public:
  NullModem(const std::string& near, const std::string& far);
  ~NullModem();
  NullModem(const NullModem&) = delete;
  NullModem& operator=(const NullModem&) = delete;

  bool connected() const { return near_.has_value() && far_.has_value(); }
  std::uint64_t bytes_to_far() const { return bytes_to_far_; }
  std::uint64_t bytes_to_near() const { return bytes_to_near_; }

 private:
  void Carry();

  std::optional<tools::Pty> near_;
  std::optional<tools::Pty> far_;
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> bytes_to_far_ = 0;
  std::atomic<std::uint64_t> bytes_to_near_ = 0;
  std::thread thread_;
};

}  // namespace baudgate::system_test
