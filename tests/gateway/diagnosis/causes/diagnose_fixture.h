// `DiagnoseTest`: a device, its neighbour and their line, whose status each test changes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "gateway/diagnosis/causes/diagnose.h"
#include "protocols/spabus/protocol.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::diagnosis {

inline Symptom SymptomOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::no_reply:
      return Symptom::silence;
    case Outcome::partial:
      return Symptom::tail_lost;
    case Outcome::corrupt:
      return Symptom::damaged;
    case Outcome::unexpected:
      return Symptom::other_reply;
    case Outcome::busy:
    case Outcome::refused:
    case Outcome::unsupported:
      return Symptom::refusal;
    default:
      return Symptom::clean;
  }
}

class DiagnoseTest : public ::testing::Test {
 protected:
  DiagnoseTest() {
    config_.lines[0].devices[1].traits = &protocols::SpabusProtocol().traits;
    record_.line = {std::shared_ptr<void>(), &config_.lines[0]};
    record_.device = {record_.line, &config_.lines[0].devices[1]};
    record_.points.resize(2);
    for (bus::PointRecord& point : record_.points) {
      point.reported = Quality::good;
      point.read_at = status::kNow.instant;
    }
    neighbour_.line = record_.line;
    neighbour_.device = {record_.line, &config_.lines[0].devices[0]};
    neighbour_.status.state = bus::DeviceState::online;
    neighbour_.status.last_ok = status::kNow.instant - 1s;
    Looked(neighbour_.status, Symptom::clean, 32);
    line_.port = bus::LineStatus::Port::open;
    Ended(Outcome::ok, 1000);
    device().state = bus::DeviceState::online;
    device().last_ok = status::kNow.instant - 1s;
  }

  bus::DeviceStatus& device() { return record_.status; }
  void Looked(bus::DeviceStatus& status, Symptom symptom, std::uint32_t count,
              Finding finding = {}) {
    finding.symptom = symptom;
    for (std::uint32_t i = 0; i < count; ++i) {
      status.findings.Add(finding);
      looked_ += 1s;
      const bool answered = IsAnswered(symptom);
      if (answered || symptom == Symptom::silence) status.failures.Add(answered, looked_);
      status.spoilt.Add(answered, looked_);
    }
  }
  void Ended(Outcome outcome, std::uint32_t count, const std::string& reason = {}) {
    Ended(outcome, SymptomOf(outcome), count, reason, {.cause = reason});
  }
  void Ended(Outcome outcome, Symptom symptom, std::uint32_t count, const std::string& reason = {},
             const Finding& finding = {}) {
    device().exchanges += count;
    device().outcomes[static_cast<std::size_t>(outcome)] += count;
    device().last_outcome = outcome;
    device().last_reason = reason;
    for (std::uint32_t i = 0; i < count; ++i) device().recent.Add(outcome);
    Finding its = finding;
    its.outcome = outcome;
    Looked(device(), symptom, count, its);
  }
  void NeverAnswered() {
    device() = {};
    device().state = bus::DeviceState::never_seen;
  }
  void Alone() { neighbour_.status.findings = {}; }
  bus::MinuteCounts& Minute() { return device().hour.At(status::kNow.instant); }

  std::vector<std::string> Say() const {
    const bus::DeviceRecord both[] = {neighbour_, record_};
    return DiagnoseDevice(line_, record_, both, status::kNow, status::kStarted);
  }
  std::vector<std::string> SayOfLine() const {
    const bus::DeviceRecord both[] = {neighbour_, record_};
    return DiagnoseLine(config_.lines[0], line_, both, status::kNow, status::kStarted);
  }

  Instant looked_ = status::kNow.instant - 1h;
  config::Config config_ = status::TwoLines();
  bus::LineStatus line_;
  bus::DeviceRecord record_;
  bus::DeviceRecord neighbour_;
};

}  // namespace baudgate::diagnosis
