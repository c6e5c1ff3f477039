// A line of real devices behind a lagging server: twins whose values say whose they are and when
// they were measured, strangers that may take their places, and the oracle that judges what the
// store shows of it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/protocols/runs/birth_oracle.h"
#include "tests/protocols/runs/lag_line.h"
#include "tests/protocols/runs/lagging_server.h"

namespace baudgate {

class LagRig {
 public:
  /// `change` may alter the line before it is built.
  LagRig(const LagCase& which, unsigned seed,
         const std::function<void(config::Line&)>& change = {});

  /// Opens the line and runs it until every point is good.
  void Open();
  VirtualLine* operator->() { return line_.get(); }
  VirtualLine& line() { return *line_; }
  LaggingServer& server() { return server_; }
  BirthOracle& oracle() { return *oracle_; }
  std::uint32_t devices() const { return static_cast<std::uint32_t>(config_.devices.size()); }
  /// How long after a request of the device an answer may come, at most.
  Duration ceiling() const;

  /// From now on the device is off, and after `off` another one answers at its address; with
  /// another name or serial number, or not to be told from it.
  void Replace(std::uint32_t device, Duration off, bool other_identity);
  /// Writes a new value to the device's writable point; false: it has none.
  bool Write(std::uint32_t device);
  /// The device is silent for so long as soon as it has confirmed a write.
  Duration silent_after_write{};
  /// Runs; what falls due meanwhile (a stranger is switched on) is done in time.
  void RunFor(Duration time);

  std::size_t requests() const { return server_.counts().requests; }
  std::size_t confirmed() const { return confirmed_; }

 private:
  struct Change {
    Instant at;
    std::function<void()> what;
  };
  struct TwinState {
    bool off = false;         ///< it has been taken away
    bool missed = false;      ///< and was asked since
    bool told_apart = false;  ///< it answers with another name
    std::size_t writes = 0;   ///< that it has confirmed
    Instant silent_until{};
  };

  std::optional<Bytes> Instead(std::size_t twin, View request);
  bool IsBeyondDetection(std::uint32_t device);

  LagCase which_;
  config::Line config_;
  std::vector<config::Device> strangers_;  ///< two for each device: alike, and of another identity
  LaggingServer server_;
  std::unique_ptr<BirthCode> code_;
  std::vector<std::unique_ptr<BirthValues>> values_;
  std::unique_ptr<VirtualLine> line_;
  std::unique_ptr<BirthOracle> oracle_;
  std::vector<Change> changes_;
  std::vector<TwinState> twins_;
  std::vector<std::size_t> answers_;  ///< by device: the twin at its address
  std::size_t confirmed_ = 0;
};

}  // namespace baudgate
