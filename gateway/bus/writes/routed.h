// A Modbus request that the gateway passes on as it is, and the reply on its way back: what
// transparent routes hand to a line (gateway/lines/line_runner.h) or to a Modbus TCP server
// elsewhere (gateway/outputs/modbus/upstream/upstream.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "config/model/listener.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate {

struct RoutedReply {
  /// ok: `pdu` is the slave's reply. refused: `pdu` is the exception that the slave itself
  /// answered. Anything else: there was no good reply, `pdu` is empty and `reason` says why.
  Outcome outcome = Outcome::none;
  Bytes pdu;
  std::string reason;
  bool sent = false;    ///< false: its deadline passed in the queue, it was refused, its client had
                        ///< left before, or the port was closed
  bool shared = false;  ///< answered by the exchange of another client's identical read
  Duration waited{};    ///< from Submit to the first byte out
};

struct RoutedRequest {
  std::uint64_t client = 0;  ///< clients of one priority are served in turn
  std::uint8_t slave = 0;    ///< address on the line, or unit id at the server
  bool broadcast = false;    ///< to slave 0, without a reply
  Bytes pdu;                 ///< function code and data, 1…253 bytes
  config::Priority priority = config::Priority::normal;
  Instant arrived;
  Instant deadline;  ///< not sent later; answered no_reply when it passes
  // The line's own: its place among all writes to the line, and how often it was sent without a
  // good reply.
  std::uint64_t sequence = 0;
  int tries = 0;
  /// Called exactly once, on any thread, unless Submit said no.
  std::function<void(RoutedReply)> done;
};

/// The reply to a request whose client has left.
inline RoutedReply Abandoned(bool sent) {
  RoutedReply reply;
  reply.outcome = Outcome::no_reply;
  reply.reason = "its client is not connected any more";
  reply.sent = sent;
  return reply;
}

/// All calls from any thread.
class RouteTarget {
 public:
  virtual ~RouteTarget() = default;
  /// False: the queue is full, or the target is stopping; `done` is not called.
  virtual bool Submit(RoutedRequest request) = 0;
  /// The client has left: its waiting requests are not sent, and answered at once. An exchange
  /// under way goes on.
  virtual void Abandon(std::uint64_t client) = 0;
};

}  // namespace baudgate
