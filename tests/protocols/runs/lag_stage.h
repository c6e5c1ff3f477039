// LagStage contains everything behind a lagging server, in virtual time or on a real pty: values
// that identify their origin and time, devices that replace others, writes, and the oracle that
// judges the store. Two derived classes add a clock and a wire: tests/protocols/runs/lag_rig.h and
// tests/soak/lag_soak_line.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "gateway/bus/writes/write_command.h"
#include "tests/protocols/runs/birth_oracle.h"
#include "tests/protocols/runs/lag_line.h"
#include "tests/protocols/runs/lag_troubles.h"
#include "tests/protocols/runs/lagging_server.h"

namespace baudgate::protocols {

class LagStage {
 public:
  LagStage(const LagCase& which, unsigned seed, config::Line line);
  virtual ~LagStage() = default;

  const LagCase& which() const { return which_; }
  LaggingServer& server() { return server_; }
  BirthOracle& oracle() { return *oracle_; }
  std::uint32_t devices() const { return static_cast<std::uint32_t>(line_.devices.size()); }
  /// Returns the longest time between a request to the device and its answer.
  Duration ceiling() const;
  bool AllGood() const;

  void Suffer(Trouble trouble);
  /// Switches the device off. After `off`, a stranger answers at its address, with or without
  /// another identity. If a stranger is there already, the configured device comes back.
  void Replace(std::uint32_t device, Duration off, bool other_identity);
  /// True if the device at this address is not the configured device, so its values are never good.
  bool IsForeign(std::uint32_t device) const;
  bool Write(std::uint32_t device);
  Duration silent_after_write{};

  std::size_t requests() const { return server_.counts().requests; }
  std::size_t confirmed() const { return confirmed_; }
  std::size_t replaced() const { return replaced_; }

 protected:
  virtual Instant NowOnStage() const = 0;
  virtual bool Submit(bus::WriteCommand command) = 0;

  void Judge(const bus::PointStore& store);
  const config::Line& line_config() const { return line_; }
  /// Devices that replace the configured devices. In the list of simulated devices they follow the
  /// configured devices.
  const std::vector<config::Device>& strangers() const { return strangers_; }
  std::size_t twins() const { return twins_.size(); }
  BirthValues& ValuesOf(std::size_t twin) { return *values_[twin]; }
  /// True if the simulated device is on the wire, even if it is switched off.
  bool IsThere(std::size_t twin) const { return twins_[twin].there; }
  std::optional<Bytes> Instead(std::size_t twin, View request);

  /// Returns when the next stranger is switched on; nothing: no replacement is pending.
  std::optional<Instant> NextChange() const;
  void Change();

 private:
  struct Replacement {
    Instant at;
    std::uint32_t device;
    std::size_t before;
    std::size_t after;
    bool other_identity;
  };
  struct TwinState {
    bool there = false;
    bool off = false;
    bool missed = false;
    bool told_apart = false;  ///< the stranger has another identity than the configured device
    std::size_t writes = 0;
    Instant silent_until{};
  };

  /// True if damage has made a frame with a good check value, which nobody can detect.
  bool IsBeyondDetection(std::uint32_t device);

  LagCase which_;
  config::Line line_;
  /// Each device has two strangers: one with the same identity, one with another identity.
  std::vector<config::Device> strangers_;
  LaggingServer server_;
  BirthCode code_;
  std::vector<std::unique_ptr<BirthValues>> values_;
  const bus::PointStore* store_ = nullptr;
  std::unique_ptr<BirthOracle> oracle_;
  std::vector<Replacement> replacements_;
  std::vector<TwinState> twins_;
  std::vector<std::size_t> answers_;
  std::size_t confirmed_ = 0;
  std::size_t replaced_ = 0;
};

}  // namespace baudgate::protocols
