// All that belongs to one line, joined: its poller, its port, telegrams by hand, the loan of its
// port, the flight recorder, and the reporter. No thread and no clock: line_runner.h brings bytes,
// calls and the time, and calls Settle after each of them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/line.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/lines/line_port.h"
#include "gateway/lines/line_reporter.h"
#include "gateway/lines/port_loan.h"
#include "gateway/lines/telegram_queue.h"
#include "gateway/records/disk/device_memory.h"
#include "gateway/records/trace/line_recorder.h"

namespace baudgate {

/// One thread at a time, except where a part says otherwise. `now` never goes back.
class LineParts {
 public:
  /// What a line needs of the gateway.
  struct Links {
    LineRecorder::Sink recordings{};
    DeviceMemory* memory = nullptr;  ///< null: what conversations learn ends with the program
    EventSink* events = nullptr;     ///< null: devices are asked for events no more than once
    LoanRecords loans{};
    std::vector<ForeignRule> foreign{};  ///< of all protocols
  };

  /// All references outlive it. See LinePort.
  LineParts(const config::Line& line, std::uint32_t first_device, const Poller::FindProtocol& find,
            PointStore& store, Transport& transport, PortRetries& retries, Links links);

  /// Conversations know what they had learned; the port opens.
  void Start(Now now);
  /// The caller keeps to Poller::kQueueLimit (CommandRoom), so the poller never refuses one.
  void Submit(WriteCommand command, Now now);
  /// See EventPath::Kept.
  void OnEventsKept(std::uint32_t device, const std::string& said, bool reported, Now now);
  /// To be called at Deadline(); earlier does nothing.
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// After every input.
  void Settle(Now now);

 private:
  const config::Line& line_;
  const std::uint32_t first_device_;
  DeviceMemory* const memory_;

 public:
  LineRecorder recorder;
  LineReporter reporter;
  Poller poller;
  TelegramQueue telegrams;
  LinePort port;
  PortLoan loan;
};

}  // namespace baudgate
