// `PtyBus` is a bus of many simulated devices on one pty, for tests of `baudgate scan`. A pty
// stores only the bit rate and whether the parity is odd, so a simulated device answers if these
// two are right for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "gateway/tools/simulate/pty.h"
#include "tests/support/twin_bus.h"

namespace baudgate::system_test {

class PtyBus {
 public:
  explicit PtyBus(const std::string& link);
  ~PtyBus();

  void Add(const TwinWish& wish) { bus_.Add(wish); }
  void Talk(const std::string& telegram) { talk_ = telegram; }
  void Start();

  const std::string& path() const { return pty_.path(); }

 private:
  void Run();
  void Answer(const Bytes& request);

  tools::Pty pty_;
  TwinBus bus_;
  std::string talk_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate::system_test
