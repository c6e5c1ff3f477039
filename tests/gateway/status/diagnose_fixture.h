// A device, its neighbour and their line as each test spoils them, and what is said of them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "gateway/status/diagnose.h"
#include "tests/gateway/status/two_lines.h"

namespace baudgate::control {

class DiagnoseTest : public ::testing::Test {
 protected:
  DiagnoseTest() {
    record_.line = &config_.lines[0];
    record_.device = &config_.lines[0].devices[1];
    record_.points.resize(2);
    neighbour_.line = record_.line;
    neighbour_.device = &config_.lines[0].devices[0];
    neighbour_.status.state = DeviceState::online;
    line_.port = LineStatus::Port::open;
    Ended(Outcome::ok, 1000);
    device().state = DeviceState::online;
    device().last_ok = kNow.instant - 1s;
  }

  DeviceStatus& device() { return record_.status; }
  void Ended(Outcome outcome, std::uint32_t count, const std::string& reason = {}) {
    device().exchanges += count;
    device().outcomes[static_cast<std::size_t>(outcome)] += count;
    device().last_outcome = outcome;
    device().last_reason = reason;
    for (std::uint32_t i = 0; i < count; ++i) device().recent.Add(outcome);
  }
  void NeverAnswered() {
    device() = {};
    device().state = DeviceState::never_seen;
  }
  std::vector<std::string> Say() const {
    const DeviceRecord both[] = {neighbour_, record_};
    return Diagnose(line_, record_, LookAt(both, kNow, kStarted), kNow, kStarted);
  }
  std::vector<std::string> SayOfLine() const {
    const DeviceRecord both[] = {neighbour_, record_};
    return SayOfLine(LookAt(both, kNow, kStarted));
  }
  std::vector<std::string> SayOfLine(const LineDevices& devices) const {
    return DiagnoseLine(config_.lines[0], line_, devices, kNow);
  }

  config::Config config_ = TwoLines();
  LineStatus line_;
  DeviceRecord record_;
  DeviceRecord neighbour_;
};

}  // namespace baudgate::control
