// `TelegramExchange` sends one telegram that a user has entered by hand, while the polls of the
// line are paused, and collects all bytes that come back. It has no I/O and no clock.
// gateway/lines/telegram_queue.h uses it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

/// The protocol, port settings and times of a device, with which the telegram is sent.
struct Speaking {
  const protocols::Protocol* protocol = nullptr;
  protocols::ParsedOptions options{};
  config::SerialSettings serial{};
  LineTimes times{};
};

class TelegramExchange final : private LineClient {
 public:
  TelegramExchange(const Speaking& as, config::Echo echo, View telegram, Instant now);

  /// Begin, Receive and OnTimer return true if the caller has to send request() now.
  bool Begin(Instant now);
  bool Receive(View bytes, Instant now);
  bool OnTimer(Instant now);
  std::optional<Instant> Deadline() const { return line_.Deadline(); }

  const protocols::Request& request() const { return request_; }
  bool has_ended() const { return end_.has_value(); }
  /// True if the exchange has ended and the silence after it is over.
  bool is_over() const { return end_ && line_.idle(); }
  /// Call only if has_ended().
  const ExchangeEnd& end() const { return *end_; }
  /// Returns all bytes that came back. If the line is configured to remove echoes, the echo is not
  /// among them.
  const Bytes& reply() const { return reply_; }

 private:
  Outcome Judge(View, Instant) override { return Outcome::ok; }
  bool Take(LineNews news);

  Line line_{static_cast<LineClient&>(*this)};
  EchoFilter echo_;
  Speaking as_;
  protocols::Request request_;
  std::optional<ExchangeEnd> end_;
  Bytes reply_;
};

}  // namespace baudgate::bus
