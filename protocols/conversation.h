// The contract of conversations. A `Conversation` belongs to one device and defines which requests
// read its points, what to send for a write, and what replies mean. gateway/bus/jobs/job.h calls it
// on the thread of its line; only one exchange is under way at a time. A conversation has no
// thread, socket or clock and writes no log. docs: protocols/README.md, "The steps".
//
// A poll of one query, in calls:
//   Queries()                → {{fast, {0, 1}}, {slow, {2}}}    points 0 and 1 share one request
//   Ask({poll, query 0})     → Request "01 03 00 00 00 02 C4 0B"
//   OnFrame(…, "01 03 04 …") → Answer {ok, readings {0: 235, 1: 17}}
// If no good frame comes, the poller repeats the request. If the repetition fails as well, the
// poller calls OnFailure instead of OnFrame.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/point.h"
#include "config/model/timing.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/frame_rule.h"

namespace baudgate::protocols {

/// The point index that means "no point of the device".
inline constexpr std::size_t kNoPoint = std::numeric_limits<std::size_t>::max();

/// The maximum number of exchanges in one task, broadcasts included. A task that requests more is
/// ended with the outcome `unexpected`.
inline constexpr int kMostSteps = 10;

struct Query {
  /// The group of all points of the query; it decides how often the query is sent.
  config::Group group = config::Group::fast;
  std::vector<std::size_t> points{};
};

struct PointValue {
  std::size_t point = kNoPoint;  ///< index of a point that is writable
  Value value{};                 ///< raw value: scale and offset have been removed
};

/// A job that the gateway gives to a conversation. Most tasks take one exchange. A task takes
/// several if a session must be opened before, or a password closed after a write.
struct Task {
  enum class Kind : std::uint8_t {
    poll,
    probe,   ///< tests with one short exchange whether the device answers
    write,   ///< writes `value` to `point`; closes a session or password that the task has opened
    events,  ///< reads the events that the device has recorded since the last task of this kind
    background,  ///< makes one low-priority exchange, see Conversation::BackgroundDue
  };
  Kind kind = Kind::poll;
  std::size_t query = 0;         ///< for polls: an index into Queries()
  std::size_t point = kNoPoint;  ///< for writes: index of a point that is writable
  Value value{};                 ///< for writes: the raw value; scale and offset have been removed
  /// For writes: further writes in the same exchange, at most as many as WritesTogether allows.
  std::vector<PointValue> also{};
};

struct Request {
  Bytes bytes{};  ///< the whole frame, checksum included
  /// The earlier requests of the same task that decide what the reply means. Example: "select
  /// channel 3" before "read". Requests with equal bytes but different contexts are different
  /// requests. The poller does not repeat a failed request that has a context; the conversation can
  /// repeat it with its context (Instead).
  Bytes context{};
  Expectation expect{};
  /// For probes: true if the device answers with the same bytes every time and gives these bytes to
  /// no other request. Its name or serial number qualifies, a measurement does not. If other bytes
  /// come, another device has sent them. The poller uses such replies to check that replies still
  /// come in the order of the requests.
  bool steady = false;
  /// True if the reply differs in length or form from the replies to all polls of the device,
  /// although its bytes may vary. Example: a probe that reads three registers, where polls read
  /// two.
  bool unlike_polls = false;
  /// True if every reply of this device answers this request correctly, so a late or repeated reply
  /// does no harm. Example: a reader that sends its present tag.
  bool any_order = false;
  /// True if the reply carries the number of its request, as in Modbus TCP, so a late or repeated
  /// reply on this connection is recognised. The number proves nothing about the serial side of a
  /// converter: a converter may put the current number and unit in front of a late reply.
  bool numbered = false;
  /// True if the request ends what an earlier request began, for example "close the password". It
  /// is sent even if the client has disconnected or the task's time is over.
  bool closes = false;
  /// True if the request only prepares a write, as a password does. If it fails, the write has not
  /// been sent.
  bool prepares = false;
  /// True if the request sets or reads the device's time, so Conversation::Stamp is called when the
  /// request is sent.
  bool stamped = false;
  /// The maximum time until the first byte of this reply, if longer than the device's reply time.
  /// Example: 5 s to clear all parameters, while reads take 500 ms.
  Duration reply{};
  /// The silence that the device needs before this request, if longer than the configured silence.
  Duration quiet{};

  bool AsksTheSameAs(const Request& other) const {
    return bytes == other.bytes && context == other.context;
  }
  /// True if no reply to a poll can be mistaken for the reply to this request.
  bool is_proof() const { return steady || unlike_polls || any_order; }
};

/// One value from a reply. It is raw: the gateway applies scale, offset and sentinels later.
struct Reading {
  /// Index into the device's points; kNoPoint: the value belongs to no point.
  std::size_t point = kNoPoint;
  Value value{};  ///< empty: the reading has a quality, but no value
  Quality quality = Quality::good;
  /// Name of the item in the protocol, for `baudgate decode`, if the value belongs to no point.
  std::string label{};
};

/// A time as a device reports it. The device's clock may be wrong. Examples: "12.345" within a
/// minute is {12345ms, 1min}; a full date is the time since 1970 with period zero.
struct SaidTime {
  Duration time{};
  Duration period{};
};

struct DeviceEvent {
  /// Channel of the device; 0: the event concerns the device as a whole.
  std::uint32_t channel = 0;
  /// The device's event number; 0: the number is unreadable, only `text` is available.
  std::uint32_t code = 0;
  std::optional<SaidTime> time{};
  std::string text{};  ///< further text from the device; mostly empty
};

struct PastValue {
  std::string name{};
  Value value{};
  Quality quality = Quality::good;
  std::string unit{};
};

/// Values that a device has measured and stored by its own clock: half an hour of a load profile,
/// or the energies at the beginning of a month.
struct PastRecord {
  /// Names the kind of record: "month", or "load_1", whose values have names such as
  /// "load_1.active_import".
  std::string series{};
  Duration begin{};  ///< begin of the interval, since 1970 in UTC
  Duration span{};   ///< length of the interval; zero: a snapshot, all values belong to one moment
  std::vector<PastValue> values{};  ///< empty: the device has lost the values of this interval
};

/// Events from one reply of a device, the oldest first. A device may delete them when it is asked
/// for newer events, so the poller asks only after they have been saved
/// (gateway/bus/devices/poller_listener.h).
struct EventBatch {
  std::vector<DeviceEvent> events{};
  std::vector<PastRecord> past{};
  std::string said{};  ///< the batch as received; a repeated batch has equal text
  bool again = false;  ///< true: this batch may be a repetition of the last batch
  /// True: the device has no more events now, so the events of the next batch happen after this
  /// exchange.
  bool drained = false;
};

enum class Then : std::uint8_t {
  done,       ///< the task has ended
  ask_again,  ///< the task goes on: call Ask again with the same task for the next exchange
  replan,     ///< the task has ended, and Queries() has changed
  restart,  ///< like replan, and all queries are due at once because they now read different points
};

/// The meaning of a reply. A task ends with the outcome of its last Answer: if a write was refused
/// and a closing exchange follows, the Answer to the closing exchange must contain `refused` again.
struct Answer {
  Outcome outcome = Outcome::ok;
  std::string reason{};  ///< one sentence for the log; empty if the outcome is ok
  /// The advice to the user in `baudgate status`. Example: "look at its display". If it is empty,
  /// `status` advises to poll a busy device less often, and to compare any other device with its
  /// profile.
  std::string remedy{};
  std::vector<Reading> readings{};
  /// The text that the reply had in place of a number. Example: "0,52". Empty: all numbers were
  /// well-formed.
  std::optional<std::string> no_number{};
  Then then = Then::done;
  /// True: the refusal says nothing about single points, because the request read several of them.
  /// They are now read in smaller requests. Example: a Modbus device refuses a block of registers
  /// with a gap in it.
  bool divides = false;
  /// True: the write was refused, but may have changed something. Example: an analog output that
  /// went to its limit.
  bool may_have_acted = false;
  /// No request must be sent to the device for this time. Example: the device has answered "busy,
  /// ask me in 2 s".
  Duration wait{};
  /// For tasks of events and background tasks: the events and records of the reply. An answer with
  /// a batch ends the task.
  std::optional<EventBatch> batch{};
};

/// A fault of the whole device that its own replies show. During the fault none of the device's
/// values is good, even if replies to polls look correct.
struct DeviceTrouble {
  /// A reason for which ConcernsDevice is true; Reason::none: the device has no fault.
  Reason reason = Reason::none;
  /// "type 0D, the profile has 08"; with Reason::none the text is only a remark.
  std::string text{};

  explicit operator bool() const { return reason != Reason::none; }
};

/// How to recognise the messages that a device sends without a request. Examples: readers of tags
/// and bar codes, weighing indicators. The name means that such messages are expected at all times:
/// gateway/bus/exchange/line.h receives them also during an exchange.
struct Standing {
  FrameRule rule = nullptr;
  Expectation expect{};  ///< Expectation::reply must be `standing`
  /// A silence of this length ends a message: the rule is then called with idle = true.
  Duration idle{};
  Duration whole{};  ///< the maximum duration of a message; a longer message is damaged
  /// True: a message begins with a certain byte. False: a message begins where the previous message
  /// ended, or after a silence of the line.
  bool marked = false;
};

/// The conversation with one device. The caller guarantees: The device's address, options and
/// points have passed the checks of the Protocol. Indices in a Task are valid at Ask and OnFrame.
/// OnFrame and OnFailure follow the Ask or Instead that returned their request. The protocol's
/// reply rule has accepted every frame.
///
/// If Queries() changes while a reply is awaited, the Task gets the new index of its query. If the
/// query no longer exists, Interpret is called instead of OnFrame, and OnFailure gets an invalid
/// query index.
class Conversation {
 public:
  virtual ~Conversation() = default;

  /// Returns the queries that read all readable points, in the order of polling. The result changes
  /// only when an Answer or OnFailure returns replan or restart, and by OnReconnect, ForgetRefusals
  /// and Recall.
  virtual std::span<const Query> Queries() const = 0;

  /// True if the device records events and the configuration requests them. Tasks of events are
  /// then run as often as fast polls, and at once when a batch has been saved. Called when
  /// Queries() is called.
  virtual bool HasEvents() const { return false; }

  /// Returns the earliest time of the next background task. Empty: no background task is wanted.
  /// Background tasks run when no other job of the line is due soon, at least once a minute. They
  /// never run while an EventBatch is being saved. Called after each task, and when a batch has
  /// been saved.
  virtual std::optional<Instant> BackgroundDue() const { return std::nullopt; }

  /// Called when the store of events has been opened, and whenever a batch of events has been
  /// saved; HasEvents is called afterwards. `said`: EventBatch::said of the newest saved batch,
  /// perhaps from before a restart; empty: there is none. If a device never deletes events, its
  /// conversation finds out in this way which events were delivered, and returns false from
  /// HasEvents until the first call.
  virtual void OnEventsKept(std::string_view /*said*/) {}

  /// Returns the next request of `task`. This can be a request that only prepares the task, such as
  /// a login; its Answer then returns ask_again. The request is perhaps never sent: if it must wait
  /// for a probe or a busy device, Ask is called again later, or the task ends. So a conversation
  /// must count requests in OnFrame, OnSent and OnFailure, not here. If the value cannot be
  /// written, returns an error of one sentence, which ends the task as unsupported.
  virtual Result<Request> Ask(const Task& task, Instant now) = 0;

  /// Returns how many of `writes`, from the first on, fit in one exchange. Example: 2 for
  /// "1WS4:0.9/S5:1.2".
  virtual std::size_t WritesTogether(std::span<const PointValue> writes) const {
    return std::min<std::size_t>(writes.size(), 1);
  }

  /// Called for a whole frame for which Check returned that it answers `request`, with a value or a
  /// refusal.
  virtual Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) = 0;

  /// Called when `request`, a broadcast (Expectation::Reply::none), has been sent. If it returns
  /// ask_again, the task continues, and Ask is called for its next request.
  virtual Then OnSent(const Task&, const Request&, Instant) { return Then::done; }

  /// Called just before a request with `stamped` is sent, to write the present time into it. The
  /// number of its bytes must not change. `arrives`: when the last byte will have been sent.
  /// `character`: the duration of one character on this line.
  virtual void Stamp(Request&, Now /*arrives*/, Duration /*character*/) {}

  /// Called with true if the clock of this machine is synchronised, else with false. Before the
  /// first call the conversation assumes that the clock is not synchronised.
  virtual void OnHostClock(bool /*right*/) {}

  /// Called when `request` has failed and is not repeated any more. The outcome is the cause:
  /// no_reply, partial, corrupt or unexpected; or busy if the request was not sent, because its
  /// time was over or it was forbidden. If the function returns ask_again, the next request must
  /// close the session or password that is open.
  ///
  /// Also called if OnFrame returned a batch, but the reply may belong to another request: the
  /// batch is discarded. Not called if the port is lost: OnReconnect is called instead.
  virtual Then OnFailure(const Task&, const Request&, Outcome, Instant) { return Then::done; }

  /// Returns the request to send before a failed request is repeated, or in its place. Empty: the
  /// failed request is repeated if it is repeatable and has no context; otherwise the exchange has
  /// failed. Examples: a DCON broadcast that is due; SPA command B, which returns the last answer
  /// to L again, because L removes events from the device.
  virtual std::optional<Request> Instead(const Request&, Outcome, Instant) { return std::nullopt; }

  /// Returns how to receive the messages that the device sends without a request. Null: it sends
  /// none. The result never changes. If the device sends none for a while, this is not a failure:
  /// it gets no probes, only the requests of Queries(), which may be empty.
  virtual const Standing* Listens() const { return nullptr; }
  /// Called for a whole message that came unasked. Readings and events of the Answer are stored
  /// like those of a reply. An outcome other than ok counts the message as damaged.
  /// EventBatch::said is not compared with earlier batches: every batch is saved, and OnEventsKept
  /// is called for each. `received`: the time of the message's last byte.
  virtual Answer OnUnasked(View /*message*/, Now /*received*/) { return {}; }
  /// Returns when OnDue must be called. Empty: not before the next message. Called after each
  /// OnUnasked and OnDue.
  virtual std::optional<Instant> DueAt() const { return std::nullopt; }
  virtual Answer OnDue(Now /*now*/) { return {}; }

  /// Called when the port was reopened, or when the device has stopped answering, was replaced, or
  /// is taken into use. Another device may be connected now, so the conversation must forget open
  /// sessions and everything learned, such as "does not know command 5".
  virtual void OnReconnect() {}

  /// Called when a person has enabled the device. The conversation then retries what was given up,
  /// for example a password that was refused.
  virtual void OnEnabled() {}

  /// Returns the fault of the whole device. Called after each reply and failure. A fault lasts over
  /// OnReconnect, until the conversation finds that it is over.
  virtual const DeviceTrouble& trouble() const {
    static const DeviceTrouble kNone;
    return kNone;
  }

  /// Returns a text of one line that is stored over restarts of the program. Example: "serial
  /// 12345". Empty: the conversation stores nothing. Called after each reply and failure, after
  /// OnEnabled and OnUnsettledWrite.
  virtual const std::string& Memory() const {
    static const std::string kNothing;
    return kNothing;
  }
  /// Called before all other functions, with the text that Memory returned before the restart. It
  /// was stored for the same gateway, line, device, protocol, address and profile, and can be
  /// empty. Not called if no text can be stored. A text that the conversation cannot parse counts
  /// as empty. `now`: for the conversion of civil times in the text.
  virtual void Recall(std::string_view /*memory*/, Now /*now*/) {}

  /// Called once after a restart if the records of writes (gateway/records/audit) contain a write
  /// without an end: a session or a password may still be open in the device. Memory must record
  /// this until the device answers.
  virtual void OnUnsettledWrite() {}

  /// Called when a recent reply on the line belonged to another request, so a recorded refusal may
  /// be wrong. The conversation asks refused items again. Returns true if Queries() has changed.
  virtual bool ForgetRefusals() { return false; }

  /// Returns the outcome that OnFrame would give for this frame, without changing any state. The
  /// poller calls it before OnFrame, also for earlier requests, to find out to which request a
  /// reply belongs. For a doubtful reply, such as text in place of a number, it may return
  /// unexpected although OnFrame accepts the reply: the poller then accepts it only if no other
  /// reply is outstanding.
  virtual Outcome Check(View request, View frame) const = 0;

  /// Returns the meaning of a reply for `baudgate decode`, for routed requests, and for a frame
  /// whose task no longer exists. Makes the same checks and readings as OnFrame, but changes no
  /// state. An item without a point gets a label.
  virtual Answer Interpret(View request, View frame) = 0;

  /// Returns the minimum times that the device itself has reported; a member is empty if it has
  /// reported none. If a configured time is longer, it applies. `character`: the duration of one
  /// character on the line of the device. Called whenever trouble() is called.
  virtual config::Timing LeastTimes(Duration character) const {
    static_cast<void>(character);
    return {};
  }

  /// Returns a text for the status: what was learned about how to ask this device, such as "at most
  /// 4 items in one request". Empty: nothing was learned.
  virtual std::string WhatIsLearned() const { return {}; }
  /// Returns a text for the status of a device that sends unasked: items that points need but that
  /// never came, with a remedy, such as "no MDA comes: switch it on at the device". Empty: nothing
  /// is missing.
  virtual std::string WhatIsMissing() const { return {}; }
  /// True if the device's clock should be set, but this machine's clock is not synchronised.
  virtual bool LacksTime() const { return false; }
};

}  // namespace baudgate::protocols
