// A telegram by hand, without a job: gateway/lines/telegram_queue.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

// One telegram by hand on a line that has paused for it: it is sent as it is, and whatever comes
// back is kept. Sans-I/O, as the line. Used by gateway/lines/telegram_queue.h.

/// The device in whose name it is sent.
struct Speaking {
  const protocols::Protocol* protocol = nullptr;
  protocols::ParsedOptions options{};
  config::SerialSettings serial{};
  LineTimes times{};
};

class TelegramExchange final : private LineClient {
 public:
  TelegramExchange(const Speaking& as, config::Echo echo, View telegram, Instant now);

  /// True: the request is to be sent now.
  bool Begin(Instant now);
  bool Receive(View bytes, Instant now);
  bool OnTimer(Instant now);
  std::optional<Instant> Deadline() const { return line_.Deadline(); }

  const protocols::Request& request() const { return request_; }
  bool has_ended() const { return end_.has_value(); }
  /// It has ended, and the line is silent again.
  bool is_over() const { return end_ && line_.idle(); }
  /// Once it has ended.
  const ExchangeEnd& end() const { return *end_; }
  /// All that came back, without its echo if that is removed.
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
