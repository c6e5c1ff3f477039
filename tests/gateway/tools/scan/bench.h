// `Bench`: a bus for scans under virtual time, with simulated devices and a second master.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/tools/scan/scanner.h"
#include "tests/support/times.h"
#include "tests/support/twin_bus.h"

namespace baudgate::scan {

class Bench final : public Wire {
 public:
  struct Master {
    Bytes request;
    config::SerialSettings serial;
    Duration every = 1s;
  };

  TwinBus bus;
  TwinBus::Two two = TwinBus::Two::together;
  bool echoes = false;
  Duration think = 10ms;
  std::optional<Master> master;
  /// The user presses Ctrl-C when this many requests were sent; nothing: never.
  std::optional<std::size_t> stop_after;
  bool stops_listening = false;  ///< the user presses Ctrl-C before the first request
  std::vector<std::pair<Bytes, config::SerialSettings>> sent;

  Status Apply(const config::SerialSettings& serial) override {
    serial_ = serial;
    return {};
  }
  Result<Gathered> Listen(Duration time) override {
    Gathered gathered;
    TakeMaster(time, gathered.heard);
    now_ += time;
    gathered.stopped = stops_listening;
    return gathered;
  }
  Result<Gathered> Ask(View request, Duration patience, Duration gap) override;
  Instant Now() override { return now_; }

 private:
  bool TakeMaster(Duration window, Bytes& heard);

  Instant now_ = kStart;
  Instant next_ = kStart;
  config::SerialSettings serial_;
  Bytes late_;
};

struct Seen final : Watcher {
  std::vector<Found> found;
  std::vector<std::string> told;
  std::vector<Duration> left;
  bool may_talk = false;
  void OnProgress(const Progress& progress) override { left.push_back(progress.left); }
  void OnFound(const Found& one) override { found.push_back(one); }
  bool MayTalk(const std::string& who) override {
    told.push_back(who);
    return may_talk;
  }
};

Wish WishFor(const std::string& protocol = {});
/// Returns the names in the shipped profiles, as the command uses them.
ProfileNames ShippedNames(const Wish& wish);

}  // namespace baudgate::scan
