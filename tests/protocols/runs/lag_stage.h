// What stands behind a lagging server, under virtual time as on a real pty: values that say whose
// they are and when they were measured, devices that take the places of others, writes, and the
// oracle that judges what the store shows of it. Who has a clock and a wire is derived from this:
// lag_rig.h, tests/soak/lag_soak_line.h.
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
  /// How long after a request of the device an answer may come, at most.
  Duration ceiling() const;
  bool AllGood() const;

  /// From now on the server has these faults.
  void Suffer(Trouble trouble);
  /// From now on the device is off, and after `off` another one answers at its address; with
  /// another name or serial number, or not to be told from it. If such a one answers there already,
  /// the first device comes back.
  void Replace(std::uint32_t device, Duration off, bool other_identity);
  /// One that is not what the configuration demands answers in its place, and is never good.
  bool IsForeign(std::uint32_t device) const;
  /// Writes a new value to the device's writable point; false: it has none.
  bool Write(std::uint32_t device);
  /// The device is silent for so long as soon as it has confirmed a write.
  Duration silent_after_write{};

  std::size_t requests() const { return server_.counts().requests; }
  std::size_t confirmed() const { return confirmed_; }
  std::size_t replaced() const { return replaced_; }

 protected:
  virtual Instant NowOnStage() const = 0;
  virtual bool Submit(bus::WriteCommand command) = 0;

  /// The oracle judges this store, from now on.
  void Judge(const bus::PointStore& store);
  const config::Line& line_config() const { return line_; }
  /// Devices that the line does not know of: twins behind those of its own.
  const std::vector<config::Device>& strangers() const { return strangers_; }
  std::size_t twins() const { return twins_.size(); }
  BirthValues& ValuesOf(std::size_t twin) { return *values_[twin]; }
  /// It is on the wire, though it may be switched off.
  bool IsThere(std::size_t twin) const { return twins_[twin].there; }
  /// What the twin says in place of its reply; nothing: that stands.
  std::optional<Bytes> Instead(std::size_t twin, View request);

  /// When a stranger is switched on; nothing: none waits for it.
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
    bool off = false;         ///< it is being taken away
    bool missed = false;      ///< and was asked since
    bool told_apart = false;  ///< it answers with another name
    std::size_t writes = 0;   ///< that it has confirmed
    Instant silent_until{};
  };

  bool IsBeyondDetection(std::uint32_t device);

  LagCase which_;
  config::Line line_;
  std::vector<config::Device> strangers_;  ///< two for each device: alike, and of another identity
  LaggingServer server_;
  BirthCode code_;
  std::vector<std::unique_ptr<BirthValues>> values_;
  const bus::PointStore* store_ = nullptr;
  std::unique_ptr<BirthOracle> oracle_;
  std::vector<Replacement> replacements_;  ///< that are under way, by time
  std::vector<TwinState> twins_;
  std::vector<std::size_t> answers_;  ///< by device: the twin at its address
  std::size_t confirmed_ = 0;
  std::size_t replaced_ = 0;
};

}  // namespace baudgate::protocols
