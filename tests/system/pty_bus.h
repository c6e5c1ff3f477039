// A bus of many twins on one pty, which answer only where the port has their bit rate; and odd
// parity where they have it: all that a pty keeps of its settings. For tests of `baudgate scan`.
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
  /// `link`: where the pty is found.
  explicit PtyBus(const std::string& link);
  ~PtyBus();

  /// Before Start.
  void Add(const TwinWish& wish) { bus_.Add(wish); }
  /// Another master says this again and again.
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
