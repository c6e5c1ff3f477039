// Decides when a port that is absent, was lost or could not be opened is tried again: as soon as
// its device file appears or its rights change, else step by step (reopen_ladder.h), until it has
// worked. Used by the owner of the port's transport.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "gateway/base/time.h"
#include "transports/port_watch.h"
#include "transports/reopen_ladder.h"

namespace baudgate {

/// What the owner of a port tells of it, so that it is opened again when that may help.
class PortRetries {
 public:
  virtual ~PortRetries() = default;
  /// A device file that opens works. A server does not: one that is taken accepts, and closes.
  virtual void OnOpened() = 0;
  /// The port has worked: tries start again at the first step, and every trouble is a new one.
  virtual void OnWorked() = 0;
  /// From now on the port is opened whenever that may help. Returns whether the trouble is news, so
  /// that one trouble is one line in the log: another than the one before, and with a server, whose
  /// refusals and losses take turns by chance, none since it last worked.
  [[nodiscard]] virtual bool OnDown(const std::string& reason) = 0;
  /// The port is opened no more, and the next trouble is a new one.
  virtual void Stop() = 0;
};

class PortKeeper final : public PortRetries {
 public:
  /// `open` is called from the loop, never from within a call. The io_context outlives the keeper,
  /// which may be stopped from `open`, but not destroyed. A `tcp://` port is never absent.
  PortKeeper(asio::io_context& io, std::string port, std::function<void()> open);
  PortKeeper(const PortKeeper&) = delete;
  PortKeeper& operator=(const PortKeeper&) = delete;

  void OnOpened() override;
  void OnWorked() override { Stop(); }
  [[nodiscard]] bool OnDown(const std::string& reason) override;
  void Stop() override;

 private:
  void Try();
  void TryIn(Duration wait);
  void OnPortChange();
  bool IsMissing() const;

  const std::string port_;
  const bool network_;
  const std::function<void()> open_;
  asio::steady_timer timer_;
  PortWatch watch_;
  ReopenLadder ladder_;
  std::shared_ptr<char> waiting_;  // gone = the timer's end means nothing
  std::set<std::string> told_;     // troubles
};

}  // namespace baudgate
