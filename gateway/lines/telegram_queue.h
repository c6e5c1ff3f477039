// `TelegramQueue` holds telegrams that users send by hand (`baudgate ask`) until they can be sent:
//
//   current poll → its end → the telegram and its reply → silence → the next poll
//
// A telegram waits until no late reply to a poll can come, because it could be mistaken for the
// reply to the telegram. If a telegram gets no reply, a late one could be mistaken for the reply to
// a poll, so probes go before the next polls.
//
// All calls must come from the line's thread.
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
  /// The references must outlive this object; `port` may be constructed later.
  TelegramQueue(const config::Line& line, bus::Poller& poller, bus::Tap& tap,
                bus::RequestPort& port)
      : line_(line), poller_(poller), tap_(tap), port_(port) {}

  /// Queues a telegram. `why_not`: the reason why nothing can be sent now; the command is then
  /// answered at once.
  void Submit(bus::WriteCommand command, const std::optional<std::string>& why_not, Now now);
  /// Returns false if no telegram is on the line, so that the bytes are for the poller.
  bool TakeBytes(View bytes, Now now);
  void OnTimer(Now now);
  /// Returns false if the current telegram must no longer be sent: its client has left, or its
  /// deadline has passed.
  bool MayGoOut(Now now) const { return !command_ || WhyNotSend(*command_, now) == nullptr; }
  /// Answers all commands, because the port is closed or lent.
  void OnClosed(const std::string& reason);
  /// Must be called after every input of the line.
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
  std::optional<bus::WriteCommand> command_;
  config::SerialSettings serial_;
  std::optional<bus::TelegramExchange> exchange_;
};

}  // namespace baudgate::lines
