// `Line` carries out one exchange at a time on one serial line: it sends a request and receives the
// reply. It is a state machine without I/O and without a clock: bytes and the time are arguments,
// and each call returns its effects as `LineNews`. An `Exchange` is one request with its
// `LineTimes`; a `LineClient` judges the frames that come as the reply. JobRunner
// (gateway/bus/poller/job_runner.h) drives the line; tests drive it with a virtual time.
// `Transmission`, `SecondReply` and `UnaskedReceiver` are parts of `Line`. `EchoFilter` and
// `EchoWatch` remove the echo of a request from the received bytes before `Line` gets them. `Tap`
// is the interface for viewers of the bytes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/device_status.h"
#include "protocols/assembler.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

// `Transmission` is the sending of one request. It computes when the first and the last character
// are sent, and stores bytes that arrive meanwhile ("early" bytes).
//
//   the port             early bytes
//   keeps its bit rate   set aside, because no reply can come yet. If more bytes arrive later,
//                        the early bytes are stray; if none arrive within the reply time, the
//                        early bytes are the reply
//   does not keep it     an echo or an early reply: `Line` reads them at once
//
class Transmission {
 public:
  /// `keeps_bit_rate`: the port sends and receives at its bit rate. False for a pty or a network.
  void OnOpened(bool keeps_bit_rate) { keeps_bit_rate_ = keeps_bit_rate; }
  void Begin(Instant now, Duration length) {
    from_ = now;
    until_ = now + length;
    early_.clear();
  }
  /// Stores bytes that arrived before the end of the transmission. Returns false if the port does
  /// not keep its bit rate, so that `Line` has to read the bytes at once.
  bool Keeps(View bytes) {
    if (!keeps_bit_rate_) return false;
    if (early_.size() < kMostKept) Append(early_, bytes);
    return true;
  }
  Bytes TakeEarly() { return std::exchange(early_, {}); }
  bool has_early() const { return !early_.empty(); }
  /// The early bytes were the reply, so the port delivers bytes faster than its bit rate.
  void OnEarlyReply() { keeps_bit_rate_ = false; }

  bool keeps_bit_rate() const { return keeps_bit_rate_; }
  Instant from() const { return from_; }
  Instant until() const { return until_; }

  /// In bytes. Early bytes above this limit are dropped. One reply with noise is far shorter, but a
  /// pty can deliver far more.
  static constexpr std::size_t kMostKept = 1024;

 private:
  bool keeps_bit_rate_ = false;
  Instant from_{};
  Instant until_{};  // computed end of the last character
  Bytes early_;
};

// `SecondReply` detects a second reply behind the reply that was accepted. If the two differ, one
// of them belongs to another request, and it is unknown which. An identical copy does no harm.

/// True if the frame contains only line ends, as a console sends them. An empty line does not count
/// as a second reply.
bool IsEmptyLine(View frame);

class SecondReply {
 public:
  /// Returns false if `assembler` contains a second whole frame that differs from `frame` and is
  /// not an empty line. `frame` was taken from `assembler` just before.
  bool IsAlone(const Bytes& frame, const protocols::Assembler& assembler);
  void Take(const Bytes& frame) { taken_ = frame; }
  /// Adds bytes that came after the reply. Returns true, once, if they contain a whole frame that
  /// differs from the reply and is not an empty line.
  bool FoundIn(View bytes);
  bool only_copies() const { return behind_.held() == 0; }

 private:
  /// The accepted reply. Empty: no reply was accepted, or a second reply was already reported.
  Bytes taken_;
  protocols::Assembler behind_;
};

// `UnaskedReceiver` finds the messages of a device that sends unasked in bytes that come at any
// time. It has no I/O and no clock. `Line` owns it. Bytes that belong to no message are returned,
// because they may be the reply of the exchange under way. `idle` and `whole` are times of
// protocols::Standing.
//
//   the received bytes                     result
//   a whole frame by the frame rule        a message, at once
//   silence for `idle`                     the frame rule is called with idle = true: a message, or
//                                          damaged
//   no whole frame within `whole`          one damaged message, which lasts until a silence or
//                                          a marked beginning
//   bytes within `whole` of the beginning  damaged as well, if the protocol marks no beginnings:
//   of a message that broke off            the bytes may be the rest of that message
struct UnaskedMessage {
  Bytes bytes;
  Duration since{};  ///< from the last byte of the message until now; see ExchangeEnd::since_reply
};

/// The result of UnaskedReceiver for received bytes or an expired timer.
struct UnaskedInput {
  std::vector<UnaskedMessage> messages;
  /// Number of damaged messages. Damage in a row counts as one message.
  std::size_t damaged = 0;
  std::string_view why{};  ///< reason of the last damage; static text
  Bytes rest;              ///< bytes that belong to no message, in the order of their arrival
};

class UnaskedReceiver {
 public:
  /// `what`: the rule and the times of the messages. It must stay valid for the lifetime of this
  /// object.
  explicit UnaskedReceiver(const protocols::Standing& what) : what_(what) {}

  /// Call when the port has opened, before all other functions.
  void Begin(Instant now);
  UnaskedInput Feed(View bytes, Instant now);
  /// Call when the time Deadline() has come. Earlier calls do nothing.
  UnaskedInput OnTimer(Instant now);

  bool receiving() const { return assembler_.held() > 0; }
  std::optional<Instant> Deadline() const;

 private:
  void Take(UnaskedInput& heard, bool idle, Instant now);
  void Align(Instant now);
  void End(UnaskedInput& heard, Instant now);
  void Damage(UnaskedInput& heard, std::string_view why);
  Instant TooLong() const;

  const protocols::Standing& what_;
  protocols::Assembler assembler_;
  /// True if the next byte begins a message, or if messages have a marked beginning
  /// (Standing::marked).
  bool aligned_ = true;
  bool damaged_ = false;
  Instant torn_until_{};  // until then, bytes may be the rest of a message that broke off
  Instant began_{};
  Instant last_byte_{};  // when the last byte came, or the port opened
};

/// The times of an exchange with one device, and the time of one character. docs/timeouts.md has
/// the diagram. (The pause before a port is reopened is in transports/port_keeper.h.)
struct LineTimes {
  Duration quiet{};  ///< silence before sending, counted from the last byte in or out
  Duration reply{};  ///< from the computed end of transmission to the first byte of the reply
  Duration gap{};    ///< longest silence inside a reply
  /// Longest time from the computed end of transmission to the end of the reply.
  Duration ceiling{};
  Duration drain{};      ///< silence that ends a drain, in which late bytes are thrown away
  Duration settle{};     ///< silence after a request that gets no reply; at least `quiet`
  Duration character{};  ///< duration with start and stop bits
};

inline Duration TransmissionTime(const protocols::Request& request, Duration character) {
  return static_cast<std::int64_t>(request.bytes.size()) * character;
}
/// Returns the longest time from the end of transmission to the first byte of the reply. A reply
/// that takes longer is late.
inline Duration ReplyTime(const protocols::Request& request, const LineTimes& times) {
  return std::max(times.reply, request.reply);
}

/// One request, and how its reply is recognised.
struct Exchange {
  protocols::Request request;
  protocols::FrameRule reply_rule = nullptr;
  LineTimes times;
  /// Silence after a reply, even after a good reply. Replies to earlier tries of the request may
  /// still come, and could be mistaken for the reply to the next request.
  Duration aftermath{};
  /// True if the replies of the device come one or more requests late. A reply to an earlier
  /// request then ends the exchange, because the right reply comes only after a later request.
  bool lags = false;
};

struct ExchangeEnd {
  Outcome outcome = Outcome::none;
  std::string reason;     ///< one sentence, if the line itself has found the reason; else empty
  Duration round_trip{};  ///< from first byte out to last byte in; zero if no frame came
  std::size_t received = 0;
  bool ended = false;  ///< the server closed the connection in place of an answer
  /// From the last byte of the reply to the end of the exchange, if the line had to wait for
  /// silence to find the end of the reply. The time is too long if the last byte has waited before
  /// it was read (`ArrivalTime` in gateway/bus/poller/job_runner.h).
  Duration since_reply{};
};

/// Bytes that belong to no exchange, for example a late reply.
struct StrayBytes {
  std::size_t count = 0;
  Duration since_end{};  ///< from the end of the last exchange to these bytes
  /// These bytes contain a whole reply that differs from the reply that was taken (SecondReply).
  bool second_reply = false;
};

/// The effects of one input, in the order in which they happened.
struct LineNews {
  UnaskedInput unasked;     ///< messages of the device that sends unasked; Line has read `rest`
  bool send = false;        ///< the caller has to send the request now
  StrayBytes stray_before;  ///< stray bytes that came before the end of the exchange under way
  /// Set if the exchange has ended. The line may still drain: see idle().
  std::optional<ExchangeEnd> end;
  StrayBytes stray;  ///< stray bytes after the exchange, or while no exchange was under way
};

class LineClient {
 public:
  virtual ~LineClient() = default;
  /// Called when a whole frame came for the exchange under way. Returns how the exchange ends,
  /// which decides whether the line drains. Must not call the line.
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

  /// Makes the line receive messages that a device sends unasked. Call before OnOpened; `what` must
  /// stay valid for the lifetime of the line.
  void Listen(const protocols::Standing& what) { unasked_.emplace(what); }

  /// `keeps_bit_rate`: this port sends and receives characters at its bit rate, so no reply can
  /// come before the last character of its request is out, and earlier bytes belong to something
  /// else. False for a pty and for a network. The line clears the flag when early bytes turn out to
  /// be the reply, as at a port of a virtual machine.
  void OnOpened(Instant now, bool keeps_bit_rate = false);
  /// Allowed in every state. An exchange ends as line_down, unless nothing of its request has been
  /// sent yet.
  LineNews OnClosed();
  LineNews Feed(View bytes, Instant now);
  /// The echo of the request under way differs from the request. The exchange ends as corrupt; a
  /// reply that still comes is not read.
  LineNews OnCollision(Instant now);
  /// The server has closed the connection, so the request under way gets no reply.
  LineNews OnEnded(Instant now);
  /// Call when Deadline() has come. Earlier calls do nothing.
  LineNews OnTimer(Instant now);

  /// Call only while idle().
  LineNews Start(Exchange exchange, Instant now);
  /// Cancels an exchange of which nothing has been sent yet (state `quiet`). No end is reported for
  /// it. In other states the call does nothing.
  void Cancel();

  bool idle() const { return state_ == State::idle && !(unasked_ && unasked_->receiving()); }
  State state() const { return state_ == State::idle && !idle() ? State::receiving : state_; }
  /// Returns when OnTimer is due; empty: the line waits for bytes or for the next exchange.
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
  Instant deadline_{};
  Instant limit_{};          // when quiet or drain ends at the latest; in receiving: the ceiling
  Instant last_activity_{};  // last byte in or out
  Instant ended_{};
  std::optional<UnaskedReceiver> unasked_;  // empty: no device of the line sends unasked
  Exchange exchange_;
  Transmission transmission_;
  protocols::Assembler assembler_;
  SecondReply second_;
  SecondReply second_before_;  // while a request is sent: `second_` of the exchange before
  LineNews news_;
};

// `Tap` is the interface for viewers of the bytes of one line: the trace and the flight recorder. A
// tap gets bytes with direction and time, the end of every exchange, and new states of devices.
// gateway/bus/counters/line_account.cpp passes bytes without echoes,
// gateway/lines/telegram_queue.cpp all bytes of a telegram by hand,
// gateway/bus/devices/device_states.cpp the states.

/// A slave that only transparent routes reach is not in the point store. Its number is this
/// constant plus its address.
inline constexpr std::uint32_t kFirstSlave = 0x8000'0000;
inline std::string SlaveName(std::uint32_t device) {
  return "slave-" + std::to_string(device - kFirstSlave);
}

/// All functions are called on the thread of the line and must not block. Bytes are valid during
/// the call only. `device` is an index in the point store, or kFirstSlave plus an address.
class Tap {
 public:
  virtual ~Tap() = default;
  /// The tap must not pass on the bytes of the request that `request.expect.secrets` lists
  /// (passwords).
  virtual void OnSent(std::uint32_t device, const protocols::Request& request, Now now) = 0;
  virtual void OnReceived(View bytes, Now now) = 0;
  /// `end.outcome` and `end.reason` are final: the conversation has judged the frame.
  virtual void OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) = 0;
  virtual void OnDeviceState(std::uint32_t device, DeviceState to, const std::string& reason,
                             Now now) = 0;
};

// `EchoFilter` removes the echo of our own request from the received bytes, on a two-wire bus whose
// adapter echoes. It compares received bytes with the request, byte by byte.
struct EchoResult {
  Bytes bytes;             ///< all bytes that are not an echo, in order
  bool complete = false;   ///< this input contained the last byte of the echo
  bool collision = false;  ///< with `verify`: the echo differs from the request, or is missing
};

/// The modes (config::Echo):
/// * strip: bytes that repeat the request are held back, and dropped when the echo is complete. At
///   the first difference they are released unchanged, so a bus that does not echo works as well.
/// * verify: as strip, and a difference is reported as a collision.
/// * off: every byte passes at once; `complete` shows whether the request came back.
class EchoFilter {
 public:
  explicit EchoFilter(config::Echo mode) : mode_(mode) {}

  /// Call before the bytes go to the transport, because the echo may be back before sending
  /// returns.
  void OnSent(View request);
  EchoResult Filter(View received);
  /// Ends the exchange: later bytes belong to another request. Returns the bytes that were held
  /// back as the start of an echo; with `verify` an incomplete echo is a collision.
  EchoResult OnExchangeEnd();

  bool holding() const { return matched_ > 0 && matched_ < expected_.size(); }

 private:
  bool passes() const { return mode_ == config::Echo::off; }

  config::Echo mode_;
  Bytes expected_;           ///< the request of this exchange
  std::size_t matched_ = 0;  ///< how many bytes of expected_ have come back
  bool differs_ = false;     ///< the bytes received so far are no echo of the request
};

// `EchoWatch` removes the echo of our own request and checks whether the bus echoes as configured.
// gateway/bus/poller/job_runner.h calls it before the bytes go to `Line`.
class EchoWatch {
 public:
  struct Received {
    Bytes bytes;             ///< all bytes that are not an echo; with `off` all received bytes
    bool echo = false;       ///< with `off`: the request under way has come back completely
    bool collision = false;  ///< with `verify`: the echo differs from the request
    const char* warning = nullptr;  ///< for the user; each warning comes once
  };

  explicit EchoWatch(config::Echo mode) : mode_(mode), filter_(mode) {}

  void OnOpened() { echoes_ = free_ = false; }
  void OnClosed() { filter_.OnExchangeEnd(); }
  /// Call before the bytes go to the port, because the echo may be back before sending returns.
  void OnSent(View request);
  /// `asked`: the request under way; null: no request is under way.
  Received OnReceived(View bytes, const protocols::Request* asked);
  /// True if `frame` may be the echo of `request` in place of a reply: it equals the request, a
  /// good reply would equal the request as well (`mirrors`), and this bus has echoed although
  /// configured as `off`.
  bool MayBeEcho(const protocols::Request& request, View frame) const;
  /// Ends the exchange of `request`. Returns true if the echo was missing with `verify`, and then
  /// writes the reason into `end`.
  bool OnExchangeEnd(const protocols::Request& request, ExchangeEnd& end);
  /// With `echo: off`: returns true if the latest request has come back.
  bool echoed() const { return echoed_; }
  /// True if this bus seems not to echo: the latest answered request has not come back. Requests
  /// whose reply equals them (`mirrors`) do not count.
  bool is_free() const { return free_; }
  /// With `echo: verify`: true if the bus echoed earlier, but no byte of the last 3 requests has
  /// come back. A fibre ring is then open, so the silence of the devices is not their fault.
  bool is_cut() const { return has_echoed_ && unechoed_ >= kUnechoedOfACut; }

 private:
  static constexpr int kUnechoedOfACut = 3;

  config::Echo mode_;
  EchoFilter filter_;
  // With `echo: off`: a request has come back nevertheless, and since then no request was answered
  // without coming back.
  bool echoes_ = false;
  bool echoed_ = false;
  bool free_ = false;
  bool has_echoed_ = false;  // with `verify`: an echo was complete at least once
  int unechoed_ = 0;         // number of requests in a row of which no byte came back
  bool told_echo_ = false;
  bool told_collision_ = false;
};

}  // namespace baudgate::bus
