// `TakenServer` is a serial server whose port another client uses. It ends every connection at
// once, by a close, a reset, or a text and a close in turn, until Serve() is called.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::system_test {

class TakenServer {
 public:
  explicit TakenServer(std::uint16_t port);
  ~TakenServer();
  TakenServer(const TakenServer&) = delete;
  TakenServer& operator=(const TakenServer&) = delete;

  bool listening() const { return listening_; }
  std::uint16_t port() const { return port_; }
  std::size_t connections() const;
  /// Returns the time between two accepted connections, which are counted from 0.
  Duration Between(std::size_t first, std::size_t second) const;
  /// From now on, keeps connections open and echoes all bytes.
  void Serve() { serve_ = true; }

 private:
  void Run(const std::stop_token& stop);
  void TurnAway(int client, std::size_t turn) const;
  void Echo(int client, const std::stop_token& stop) const;

  const std::uint16_t port_;
  int socket_;
  bool listening_ = false;
  std::atomic<bool> serve_ = false;
  mutable std::mutex mutex_;
  std::vector<Instant> accepted_;
  std::jthread thread_;
};

}  // namespace baudgate::system_test
