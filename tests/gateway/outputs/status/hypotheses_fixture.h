// `HypothesesTest`: makes the status of a device from symptoms, and returns the causes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/diagnosis/causes/hypotheses.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/diagnosis/causes/diagnose_fixture.h"

namespace baudgate::status {

using enum Symptom;

struct Seen {
  Symptom symptom;
  std::uint32_t count;
  Finding finding{};
};

enum : unsigned {
  kAnswered = 1,
  kNeighbour = 2,
  kServer = 4,  ///< the line is Modbus TCP
  kHere = 8,
};

struct Row {
  std::vector<Seen> seen;
  std::string says;
  unsigned state = 0;
  std::vector<bus::QueryCount> queries{};

  bool Is(unsigned flag) const { return (state & flag) != 0; }
};

class HypothesesTest : public diagnosis::DiagnoseTest {
 protected:
  std::vector<std::pair<std::string, std::string>> CausesOf(const Row& row) {
    config_.lines[0].port = row.Is(kServer) ? "tcp://10.0.0.7:502" : "/dev/ttyUSB0";
    config_.lines[0].serial = row.Is(kServer)
                                  ? config::SerialSettings{.baud = config::SerialSettings::kNoWire}
                                  : TwoLines().lines[0].serial;
    const config::Traits* const traits = config_.lines[0].devices[1].traits;
    if (row.Is(kServer))
      config_.lines[0].devices[1].traits = &protocols::ModbusTcpProtocol().traits;
    NeverAnswered();
    device().timing.reply = 100ms;
    device().timing.gap = 50ms;
    device().state = row.Is(kAnswered) ? bus::DeviceState::offline : bus::DeviceState::never_seen;
    if (row.Is(kHere)) device().state = bus::DeviceState::degraded;
    if (row.Is(kAnswered)) device().last_ok = kNow.instant - 1min;
    for (const Seen& seen : row.seen) Looked(device(), seen.symptom, seen.count, seen.finding);
    device().exchanges = 30;
    device().queries = row.queries;
    neighbour_.status.findings = {};
    if (row.Is(kNeighbour)) Looked(neighbour_.status, clean, 32);
    const bus::DeviceRecord both[] = {neighbour_, record_};
    const diagnosis::Evidence evidence = diagnosis::Gather(line_, record_, both, kNow);
    std::vector<std::pair<std::string, std::string>> causes;
    for (const diagnosis::Hypothesis* hypothesis : Judge(evidence)) {
      causes.emplace_back(hypothesis->cause, hypothesis->say(evidence));
    }
    config_.lines[0].devices[1].traits = traits;
    return causes;
  }
  std::string SayOf(const Row& row) {
    std::string text;
    for (const auto& [cause, said] : CausesOf(row)) text += (text.empty() ? "" : " | ") + said;
    return text;
  }
};

}  // namespace baudgate::status
