// Telegrams by hand (`baudgate ask`) that wait for their turn on a line: when the poller has ended
// its present job, it pauses, the telegram has the line to itself, and the poller goes on.
//
//   poll under way → its end → the telegram and its reply → silence → the next poll
//
// It waits until no late reply to a poll can come, which would pass for its own. If it gets no
// reply, one may still come and pass for that of a poll: probes go before the next polls.
//
// One thread, the line's.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "config/model/line.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate::lines {

class TelegramQueue {
 public:
  /// All outlive it; `port` may be made later than this.
  TelegramQueue(const config::Line& line, bus::Poller& poller, bus::Tap& tap,
                bus::RequestPort& port)
      : line_(line), poller_(poller), tap_(tap), port_(port) {}

  /// `why_not`: nothing can be sent now; it is answered at once.
  void Submit(bus::WriteCommand command, const std::optional<std::string>& why_not, Now now);
  /// False: no telegram is on the line, and the bytes are the poller's.
  bool TakeBytes(View bytes, Now now);
  void OnTimer(Now now);
  /// See Poller.
  bool MayGoOut(Now now) const { return !command_ || WhyNotSend(*command_, now) == nullptr; }
  /// The port is gone, or is given away.
  void OnClosed(const std::string& reason);
  /// After every input of the line.
  void Settle(Now now);
  std::optional<Instant> Deadline() const;
  bool is_busy() const { return exchange_.has_value(); }

 private:
  static const char* WhyNotSend(const bus::WriteCommand& command, Now now);
  void Withdraw(Now now);
  void Hand(bool send, Now now);
  void TakeBack();
  void End(Now now);
  static void Answer(bus::WriteCommand& command, WriteEnd end, const std::string& reason,
                     Outcome outcome);

  const config::Line& line_;
  bus::Poller& poller_;
  bus::Tap& tap_;
  bus::RequestPort& port_;
  std::deque<bus::WriteCommand> waiting_;
  std::optional<bus::WriteCommand> command_;  // under way
  config::SerialSettings serial_;
  std::optional<bus::TelegramExchange> exchange_;
};

}  // namespace baudgate::lines
