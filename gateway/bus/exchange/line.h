// Line carries out one exchange at a time on one bus: the line discipline as a state machine
// without sockets, clock or YAML. Bytes and time come in as arguments; their effect is returned as
// LineNews. Exchange is one request with its LineTimes. LineClient judges its frames, and is asked
// nothing else. Line is driven by gateway/bus/poller/job_runner.h and in tests under virtual time.
// Transmission, SecondReply and UnaskedReceiver are parts of Line; Tap is the interface for viewers
// of its bytes. EchoFilter and EchoWatch take the echo of a request out of the bytes before Line
// gets them.
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

// The transmission of one request: when its first and its last character go out, and which bytes
// come meanwhile.
//
//   the port           bytes that come during the transmission
//   keeps its bit rate  no reply is possible yet: kept apart. Stray as soon as more bytes come; the
//                       reply, if nothing else comes in the reply time
//   does not            an echo, or a reply: they are left to the line
//
class Transmission {
 public:
  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(bool keeps_bit_rate) { keeps_bit_rate_ = keeps_bit_rate; }
  /// The first character goes out now; all take `length`.
  void Begin(Instant now, Duration length) {
    from_ = now;
    until_ = now + length;
    early_.clear();
  }
  /// Bytes have come before its end. False: they are left to the line.
  bool Keeps(View bytes) {
    if (!keeps_bit_rate_) return false;
    if (early_.size() < kMostKept) Append(early_, bytes);
    return true;
  }
  /// The bytes that were kept apart.
  Bytes TakeEarly() { return std::exchange(early_, {}); }
  bool has_early() const { return !early_.empty(); }
  /// They were the reply: the port forwards as fast as it can.
  void OnEarlyReply() { keeps_bit_rate_ = false; }

  bool keeps_bit_rate() const { return keeps_bit_rate_; }
  Instant from() const { return from_; }
  Instant until() const { return until_; }

  /// An early reply with noise around it. A pty delivers faster than any wire, so what is kept
  /// needs a bound of its own.
  static constexpr std::size_t kMostKept = 1024;

 private:
  bool keeps_bit_rate_ = false;
  Instant from_{};
  Instant until_{};  // computed
  Bytes early_;      // kept apart
};

// Looks behind a reply for a second, different one: then one of the two belongs to another request,
// and which one is not known. Copies do no harm.

/// A text without a value between two line ends, as a console sends it, is no second reply.
bool IsEmptyLine(View frame);

class SecondReply {
 public:
  /// `frame` was cut from `assembler`. False: a whole frame that differs is behind it there.
  bool IsAlone(const Bytes& frame, const protocols::Assembler& assembler);
  /// The frame that was alone was taken for the reply.
  void Take(const Bytes& frame) { taken_ = frame; }
  /// Bytes that came after it. True: a whole frame that differs is there. Told once.
  bool FoundIn(View bytes);
  /// Nothing has come after the frame but whole copies of it.
  bool only_copies() const { return behind_.held() == 0; }

 private:
  /// Empty: no reply was taken, or a second one was told already.
  Bytes taken_;
  protocols::Assembler behind_;  // bytes after the frame
};

// Receives what a device sends unasked: whole messages out of bytes that come at any time. Sans-I/O
// and pure as the line, which owns it. Bytes of no message are left for the exchange under way.
//
//   what is held          what it becomes
//   whole by its rule     a message, at once
//   silent for `idle`     the rule is asked once more: a message, or damaged
//   longer than `whole`   damaged, and so is what follows up to a silence or a marked beginning
//   behind a message      damaged as well, where no beginning is marked and `whole` is not over: it
//   that broke off        may be the rest of that one
struct UnaskedMessage {
  Bytes bytes;
  Duration since{};  ///< from its last byte to now; see ExchangeEnd::since_reply
};

/// The effect of one input.
struct UnaskedInput {
  std::vector<UnaskedMessage> messages;
  std::size_t damaged = 0;  ///< messages, as far as they can be told apart
  std::string_view why{};   ///< reason of the last of them; static text
  Bytes rest;               ///< bytes of no message, in their order
};

class UnaskedReceiver {
 public:
  /// `what` outlives it.
  explicit UnaskedReceiver(const protocols::Standing& what) : what_(what) {}

  /// Before all else: the port has opened.
  void Begin(Instant now);
  UnaskedInput Feed(View bytes, Instant now);
  /// When Deadline() has come. Early calls do nothing.
  UnaskedInput OnTimer(Instant now);

  /// Part of a message has come.
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
  /// The next byte begins a message, or messages are recognised by their beginning.
  bool aligned_ = true;
  bool damaged_ = false;  // what came last
  Instant torn_until_{};  // what begins before this may be the rest of a message that broke off
  Instant began_{};       // the message that is held
  Instant last_byte_{};   // or when the port opened
};

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
inline Duration TransmissionTime(const protocols::Request& request, Duration character) {
  return static_cast<std::int64_t>(request.bytes.size()) * character;
}
/// From there to the first byte of the reply. A reply that takes longer is late.
inline Duration ReplyTime(const protocols::Request& request, const LineTimes& times) {
  return std::max(times.reply, request.reply);
}

/// One request and how its answer is recognised.
struct Exchange {
  protocols::Request request;
  protocols::FrameRule reply_rule = nullptr;
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
  /// longer, because that byte may have waited (ArrivalTime in
  /// gateway/bus/poller/job_runner.h).
  Duration since_reply{};
};

/// Bytes that belong to no exchange, for example a late reply.
struct StrayBytes {
  std::size_t count = 0;
  Duration since_end{};  ///< from the end of the last exchange
  /// A whole reply among these bytes differs from the reply that was taken: one of the two replies
  /// belongs to another request.
  bool second_reply = false;
};

/// The effect of one input. If several fields are set, they happened in this order.
struct LineNews {
  UnaskedInput unasked;            ///< from the device that sends unasked; no rest
  bool send = false;               ///< the request is to be sent now
  StrayBytes stray_before;         ///< before the end of the exchange under way
  std::optional<ExchangeEnd> end;  ///< the line may still drain: see idle()
  StrayBytes stray;                ///< after that end, or while no exchange was under way
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
  void Listen(const protocols::Standing& what) { unasked_.emplace(what); }

  /// `keeps_bit_rate`: characters take their time on this port, so no reply can come before the
  /// last character of its request is out, and earlier bytes are the rest of something else. False
  /// for a pty and for a network. It is cleared when an early reply turns out to be the real one (a
  /// port of a virtual machine).
  void OnOpened(Instant now, bool keeps_bit_rate = false);
  /// From anywhere. An exchange ends as line_down, unless nothing of it has been sent yet.
  LineNews OnClosed();
  LineNews Feed(View bytes, Instant now);
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
  Transmission transmission_;       // of its request
  protocols::Assembler assembler_;  // of its reply
  SecondReply second_;
  SecondReply second_before_;  // of the exchange before, while a request is sent
  LineNews news_;              // of the input that is being handled
};

// The interface for viewers of the bytes of one line, with direction, time and the end of every
// exchange: the trace and the flight recorder. Fed by gateway/bus/counters/line_account.cpp with
// what is left after the echo filter, by gateway/bus/devices/device_states.cpp with states,
// and by gateway/lines/telegram_queue.cpp with all bytes of a telegram by hand.

/// Slaves that only transparent routes reach stand in no store: they are numbered by their address
/// from here on.
inline constexpr std::uint32_t kFirstSlave = 0x8000'0000;
inline std::string SlaveName(std::uint32_t device) {
  return "slave-" + std::to_string(device - kFirstSlave);
}

/// All calls come on the line's thread and must not block. Bytes are valid during the call only.
/// `device` is an index in the point store, or kFirstSlave and an address.
class Tap {
 public:
  virtual ~Tap() = default;
  /// Nothing of `request.expect.secrets` may leave the tap.
  virtual void OnSent(std::uint32_t device, const protocols::Request& request, Now now) = 0;
  virtual void OnReceived(View bytes, Now now) = 0;
  /// `end.outcome` and `end.reason` are final: the conversation has judged the frame.
  virtual void OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) = 0;
  virtual void OnDeviceState(std::uint32_t device, DeviceState to, const std::string& reason,
                             Now now) = 0;
};

// Takes our own request out of what comes back on a two-wire bus whose adapter echoes: compares it
// with what was sent, byte by byte, and holds back what is equal.
struct EchoResult {
  Bytes bytes;             ///< what is not echo, in order
  bool complete = false;   ///< the last byte of the echo came in just now
  bool collision = false;  ///< verify only: the echo differs from what was sent, or is missing
};

/// strip: bytes are held back while they repeat the request and dropped once it is whole; at the
/// first difference they are released untouched, so a bus that does not echo works. verify: the
/// same, and the difference is reported. off: every byte passes at once, and `complete` tells
/// whether the request came back.
class EchoFilter {
 public:
  explicit EchoFilter(config::Echo mode) : mode_(mode) {}

  /// Before the bytes go to the transport: an echo may be back before Send returns.
  void OnSent(View request);
  EchoResult Filter(View received);
  /// The exchange is over and the next bytes belong to another one. Gives back what was still held
  /// as the start of an echo; in verify mode an echo that never became whole is a collision.
  EchoResult OnExchangeEnd();

  /// Bytes have arrived that look like the start of the echo.
  bool holding() const { return matched_ > 0 && matched_ < expected_.size(); }

 private:
  bool passes() const { return mode_ == config::Echo::off; }

  config::Echo mode_;
  Bytes expected_;           ///< sent in this exchange
  std::size_t matched_ = 0;  ///< of expected_, seen so far
  bool differs_ = false;     ///< this exchange has no echo, or a wrong one
};

// Which bytes from a bus are the echo of our own request, and whether the echo is as configured.
// Called by gateway/bus/poller/job_runner.h before the bytes go to gateway/bus/exchange/line.h.
class EchoWatch {
 public:
  struct Received {
    Bytes bytes;                    ///< what is not echo; with `off`, all that came
    bool echo = false;              ///< `off`: the request under way has come back whole
    bool collision = false;         ///< `verify`: the echo differs from what was sent
    const char* warning = nullptr;  ///< for the user, each warning once
  };

  explicit EchoWatch(config::Echo mode) : mode_(mode), filter_(mode) {}

  void OnOpened() { echoes_ = free_ = false; }
  void OnClosed() { filter_.OnExchangeEnd(); }
  /// Before the bytes go to the port: an echo may be back before sending returns.
  void OnSent(View request);
  /// `asked`: the request under way; null when there is none.
  Received OnReceived(View bytes, const protocols::Request* asked);
  /// The frame equals its request, the protocol confirms writes in that way, and this bus was seen
  /// to echo: perhaps no device has answered.
  bool MayBeEcho(const protocols::Request& request, View frame) const;
  /// The exchange of `request` is over; its reason is set if the echo explains it. True: with
  /// `verify` the echo was missing.
  bool OnExchangeEnd(const protocols::Request& request, ExchangeEnd& end);
  /// `off`: the request sent last has come back.
  bool echoed() const { return echoed_; }
  /// The latest request that was answered, and whose reply cannot equal it, has not come back.
  bool is_free() const { return free_; }
  /// `verify`: the bus used to echo, and none of the latest requests came back: a fibre ring is
  /// open somewhere, and its devices are not to blame for their silence.
  bool is_cut() const { return has_echoed_ && unechoed_ >= kUnechoedOfACut; }

 private:
  static constexpr int kUnechoedOfACut = 3;

  config::Echo mode_;
  EchoFilter filter_;
  bool echoes_ = false;  // `off`, and yet requests have come back since the last reply without one
  bool echoed_ = false;  // the present request has
  bool free_ = false;
  bool has_echoed_ = false;  // `verify`: ever
  int unechoed_ = 0;         // requests in a row of which nothing came back
  bool told_echo_ = false;
  bool told_collision_ = false;
};

}  // namespace baudgate::bus
