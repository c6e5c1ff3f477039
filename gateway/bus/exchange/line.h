// One exchange at a time on one bus: the line discipline as a state machine without sockets, clock
// or YAML. Bytes and time come in as arguments; their effect is returned as LineNews. The client is
// asked one thing only: what a frame means. Driven by gateway/bus/poller/line_side.cpp, in tests
// under virtual time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/second_reply.h"
#include "gateway/bus/exchange/transmission.h"
#include "gateway/bus/exchange/unasked_receiver.h"
#include "protocols/assembler.h"
#include "protocols/conversation.h"

namespace baudgate {

/// The times of an exchange with one device (the pause before a port is reopened is in
/// transports/port_keeper.h), and the time of one character. docs/timeouts.md has the diagram.
struct LineTimes {
  Duration quiet{};      ///< silence before sending, from the last byte in or out
  Duration reply{};      ///< from the computed end of transmission to the first byte of the reply
  Duration gap{};        ///< longest silence inside a frame
  Duration ceiling{};    ///< whole exchange, from the computed end of transmission
  Duration drain{};      ///< silence that ends a drain
  Duration settle{};     ///< silence after a request without a reply, if quiet is shorter
  Duration character{};  ///< start to stop bit
};

/// From the first character of the request to the computed end of its last one.
inline Duration TransmissionTime(const Request& request, Duration character) {
  return static_cast<std::int64_t>(request.bytes.size()) * character;
}
/// From there to the first byte of the reply. A reply that takes longer is late.
inline Duration ReplyTime(const Request& request, const LineTimes& times) {
  return std::max(times.reply, request.reply);
}

/// One request and how its answer is recognised.
struct Exchange {
  Request request;
  FrameRule reply_rule = nullptr;
  LineTimes times;
  /// Silence after a reply, even a good one, because replies to earlier tries may still be under
  /// way: the reply that came may be to one of these, and the others must not meet another request.
  Duration aftermath{};
  /// The device lags by some requests: the reply to another request ends the exchange, because its
  /// own comes only after a later request.
  bool lags = false;
};

struct ExchangeEnd {
  Outcome outcome = Outcome::none;
  std::string reason;        ///< one sentence if the line itself knows why; else empty
  Duration round_trip{};     ///< first byte out to last byte in; zero when no frame came
  std::size_t received = 0;  ///< bytes that came for it
  bool ended = false;        ///< the server closed the connection in place of an answer
  /// From the last byte of its reply to this end, if only silence showed that it was the last; or
  /// longer, because that byte may have waited (gateway/bus/devices/arrival_time.h).
  Duration since_reply{};
};

/// Bytes that belong to no exchange, for example a late reply.
struct StrayBytes {
  std::size_t count = 0;
  Duration since_end{};  ///< from the end of the last exchange
};

/// The effect of one input. If several fields are set, they happened in this order.
struct LineNews {
  UnaskedInput unasked;            ///< from the device that sends unasked; no rest
  bool send = false;               ///< the request is to be sent now
  StrayBytes stray_before;         ///< before the end of the exchange under way
  std::optional<ExchangeEnd> end;  ///< the line may still drain: see idle()
  StrayBytes stray;                ///< after that end, or while no exchange was under way
  /// After the reply that was taken came another whole one that differs: one of the two belongs to
  /// another request.
  bool second_reply = false;
};

class LineClient {
 public:
  virtual ~LineClient() = default;
  /// A whole frame came for the exchange under way. The outcome decides whether the line drains. Do
  /// not call the line from here.
  virtual Outcome Judge(View frame, Instant now) = 0;
};

class Line {
 public:
  enum class State : std::uint8_t {
    closed,
    idle,
    quiet,
    sending,
    settle,
    await_first,
    receiving,
    drain
  };

  explicit Line(LineClient& client) : client_(client) {}

  /// A device of the line sends such messages unasked, at any time. Before OnOpened; `what`
  /// outlives the line.
  void Listen(const Standing& what) { unasked_.emplace(what); }

  /// `keeps_bit_rate`: characters take their time on this port, so no reply can come before the
  /// last character of its request is out, and earlier bytes are the rest of something else. False
  /// for a pty and for a network. It is cleared when an early reply turns out to be the real one (a
  /// port of a virtual machine).
  void OnOpened(Instant now, bool keeps_bit_rate = false);
  /// From anywhere. An exchange ends as line_down, unless nothing of it has been sent yet.
  LineNews OnClosed();
  LineNews OnBytes(View bytes, Instant now);
  /// The echo of the request under way differs from it: the exchange ends as corrupt, whatever may
  /// still be answered.
  LineNews OnCollision(Instant now);
  /// The server has ended the connection: the request under way gets no reply.
  LineNews OnEnded(Instant now);
  /// When Deadline() has come. Early calls do nothing.
  LineNews OnTimer(Instant now);

  /// Only when idle().
  LineNews Start(Exchange exchange, Instant now);
  /// Nothing of the exchange has been sent yet (state quiet): it does not take place and has no
  /// end.
  void Cancel();

  bool idle() const { return state_ == State::idle && !(unasked_ && unasked_->receiving()); }
  State state() const { return state_ == State::idle && !idle() ? State::receiving : state_; }
  /// When OnTimer is due; empty while the line waits for bytes or work only.
  std::optional<Instant> Deadline() const;

 private:
  LineNews TakeNews() { return std::exchange(news_, {}); }
  void Hear(UnaskedInput heard, Instant now);
  void TakeBytes(View bytes, Instant now);
  void TakeTimer(Instant now);
  void BeginSending(Instant now);
  void EndSending(Instant now);
  void Receive(View bytes, Instant now);
  void TakeFrame(bool idle, Instant now);
  void TellStray(std::size_t count, Duration since_end);
  void TakeStray(View bytes, Instant now);
  void OnGap(Instant now);
  void Finish(Outcome outcome, std::string reason, Instant now);
  bool TakeEarly(Instant now);
  void TakeAhead(Instant now);
  void DropEarly();
  void Drain(Duration silence, Instant now);

  LineClient& client_;
  State state_ = State::closed;
  Instant deadline_{};                      // of the current state
  Instant limit_{};                         // babble bound of Quiet and Drain
  Instant last_activity_{};                 // last byte in or out
  Instant ended_{};                         // the last exchange
  std::optional<UnaskedReceiver> unasked_;  // empty: no device sends unasked
  Exchange exchange_;
  Transmission transmission_;  // of its request
  Assembler assembler_;        // of its reply
  SecondReply second_;
  LineNews news_;  // of the input that is being handled
};

}  // namespace baudgate
