// The contract of conversations. A `Conversation` belongs to one device and defines which requests
// read its points, what to send for a write, and what replies mean. gateway/bus/jobs/job.h calls
// it, one exchange after another, on the thread of its line. It has no thread, socket or clock and
// writes no log. docs: protocols/README.md, "The steps".
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

/// The point index that stands for "no point of the device".
inline constexpr std::size_t kNoPoint = std::numeric_limits<std::size_t>::max();

/// The largest number of exchanges in one task, broadcasts included. A task that asks for more ends
/// as unexpected.
inline constexpr int kMostSteps = 10;

/// Points that one request reads together.
struct Query {
  /// The group of all its points; it decides how often the query is sent.
  config::Group group = config::Group::fast;
  std::vector<std::size_t> points{};  ///< indices into the device's points
};

struct PointValue {
  std::size_t point = kNoPoint;  ///< a point that may be written
  Value value{};                 ///< raw: scale and offset have been removed
};

/// A job that the gateway gives to a conversation. Most tasks take one exchange. A task takes
/// several if a session must be opened first, or a password closed after a write.
struct Task {
  enum class Kind : std::uint8_t {
    poll,        ///< read the points of Queries()[query]
    probe,       ///< find out with one short exchange whether the device answers
    write,       ///< write `value` to `point`, then close any session or password that was opened
    events,      ///< read the events that the device has recorded since the last such task
    background,  ///< one low-priority exchange, see Conversation::BackgroundDue
  };
  Kind kind = Kind::poll;
  std::size_t query = 0;         ///< polls only: less than Queries().size()
  std::size_t point = kNoPoint;  ///< writes only: a point that may be written
  Value value{};                 ///< writes only: raw, scale and offset have been removed
  /// Writes only: further writes in the same exchange, as many as WritesTogether has allowed.
  std::vector<PointValue> also{};
};

struct Request {
  Bytes bytes{};  ///< the whole frame, checksum included
  /// Earlier bytes of the same task, if they decide what the reply means: "select channel 3" before
  /// "read". Requests with equal bytes but different contexts are different requests. A request
  /// with a context is never repeated alone: its context is sent again first.
  Bytes context{};
  Expectation expect{};
  /// Probes only: the device answers with the same bytes every time and gives these bytes to no
  /// other request. Its name or serial number qualifies, a measurement does not. Other bytes come
  /// from another device. The poller uses such replies to check that replies still come in the
  /// order of the requests.
  bool steady = false;
  /// The reply differs in length or form from the replies to all polls of the device, but its bytes
  /// may vary. Example: a probe that reads three registers, where polls read two.
  bool unlike_polls = false;
  /// The reply is correct for any request, so a late or repeated copy does no harm.
  bool any_order = false;
  /// The reply carries the number of its request, as in Modbus TCP, so a late or repeated reply on
  /// this connection is recognised. The number proves nothing about the serial side of a converter:
  /// a converter may put the current number and unit in front of a late reply.
  bool numbered = false;
  /// The request ends what an earlier request began, for example "close the password". It is sent
  /// even if the client has disconnected or the task's time is over.
  bool closes = false;
  /// The request only prepares a write, as a password does. If it fails, nothing has been written.
  bool prepares = false;
  /// The request sets or reads the device's time: Conversation::Stamp is called when it is sent.
  bool stamped = false;
  /// The maximum time until the first byte of this reply, if longer than the device's reply time.
  /// Example: 5 s to clear all parameters, while reads take 500 ms.
  Duration reply{};
  /// The silence that the device needs before this request, if longer than usual.
  Duration quiet{};

  bool AsksTheSameAs(const Request& other) const {
    return bytes == other.bytes && context == other.context;
  }
  /// True if no reply to a poll can be mistaken for the reply to this request.
  bool is_proof() const { return steady || unlike_polls || any_order; }
};

/// One value from a reply, still raw: the gateway applies scale, offset and sentinels.
struct Reading {
  std::size_t point = kNoPoint;  ///< index into the device's points
  Value value{};                 ///< empty: there is no value, only a quality
  Quality quality = Quality::good;
  std::string label{};  ///< without a point (`baudgate decode`): the item's name in the protocol
};

/// A time as a device reports it. "12.345" within a minute is {12345ms, 1min}; a full date is the
/// time since 1970 with period zero. The device's clock may be wrong.
struct SaidTime {
  Duration time{};
  Duration period{};  ///< the time is known modulo this period; zero: the full time is known
};

/// An event that a device has recorded and reports.
struct DeviceEvent {
  std::uint32_t channel = 0;  ///< 0: the device as a whole
  std::uint32_t code = 0;  ///< the device's event number; 0: unreadable, only `text` is available
  std::optional<SaidTime> time{};
  std::string text{};  ///< further text from the device; mostly empty
};

struct PastValue {
  std::string name{};  ///< "active_import"
  Value value{};
  Quality quality = Quality::good;
  std::string unit{};
};

/// Values that a device has measured and stored by its own clock: half an hour of a load profile,
/// or the energies at the beginning of a month.
struct PastRecord {
  std::string series{};  ///< "load_1", with values such as "load_1.active_import"; "month"
  Duration begin{};      ///< since 1970
  Duration span{};       ///< zero: a snapshot, all values belong to one moment
  std::vector<PastValue> values{};  ///< empty: the device has lost them
};

/// Events from one reply of a device, the oldest first. The device deletes them when it is asked
/// for the next ones, so the poller asks only after they have been saved
/// (gateway/bus/devices/poller_listener.h).
struct EventBatch {
  std::vector<DeviceEvent> events{};
  std::vector<PastRecord> past{};
  std::string said{};  ///< the batch as received; equal text identifies a repeated batch
  bool again = false;  ///< true: this may be a repetition of the last batch
  /// True: the device has no more events, so later events are newer than this exchange.
  bool drained = false;
};

/// The continuation of a task after an exchange.
enum class Then : std::uint8_t {
  done,       ///< the task has ended
  ask_again,  ///< the task goes on: call Ask again with the same task for the next exchange
  replan,     ///< the task has ended, and Queries() has changed
  restart,  ///< like replan, and all queries are due at once because they now read different points
};

/// The meaning of a reply. The outcome of a task is the outcome of its last Answer. So if a write
/// was refused and a closing exchange follows, the Answer to the closing exchange returns refused
/// again.
struct Answer {
  Outcome outcome = Outcome::ok;
  std::string reason{};  ///< one sentence for the log; empty when ok
  /// The advice to the user in `baudgate status`: "look at its display". Empty: the default advice.
  /// It is to poll less often if the device is busy, else to compare the device with its profile.
  std::string remedy{};
  std::vector<Reading> readings{};
  /// The text found in place of a number: "0,52". Nothing: numbers are well-formed.
  std::optional<std::string> no_number{};
  Then then = Then::done;
  /// The write was refused, but may have changed something: an analog output that went to its
  /// limit.
  bool may_have_acted = false;
  Duration wait{};  ///< the device must get no request for this time: "busy, ask me in 2 s"
  /// Only for tasks of events and background tasks. An answer with a batch ends the task.
  std::optional<EventBatch> batch{};
};

/// A fault of the whole device, from its own replies. While it lasts, none of the device's values
/// is good, even if replies to polls look correct.
struct DeviceTrouble {
  Reason reason = Reason::none;  ///< a reason for which ConcernsDevice is true; none: no fault
  std::string text{};  ///< "type 0D, the profile says 08"; with Reason::none: a remark only

  explicit operator bool() const { return reason != Reason::none; }
};

/// How to recognise messages that a device sends unasked: readers of tags and bar codes, weighing
/// indicators. gateway/bus/exchange/line.h receives such messages, also during an exchange.
struct Standing {
  FrameRule rule = nullptr;
  Expectation expect{};  ///< reply: standing
  Duration idle{};   ///< the silence that ends a message: then the rule is called with idle = true
  Duration whole{};  ///< the maximum duration of a message; a longer one is damaged
  /// True: a message is recognised by its first byte. False: a message begins where the previous
  /// one ended, or after a silence of the line.
  bool marked = false;
};

/// The conversation with one device. The caller guarantees: the device's address, options and
/// points have passed the checks of the Protocol; indices in a Task are valid at Ask and OnFrame;
/// OnFrame and OnFailure follow the Ask or Instead that returned their request; every frame was
/// accepted by the reply rule.
/// If Queries() changes while a reply is awaited, the Task gets the new index of its query. If the
/// query no longer exists, Interpret is called instead of OnFrame, and OnFailure gets an invalid
/// query index.
class Conversation {
 public:
  virtual ~Conversation() = default;

  /// Returns the requests that read all readable points, in the order of polling. The result
  /// changes only when an Answer or OnFailure returns replan or restart, and by OnReconnect,
  /// ForgetRefusals and Recall.
  virtual std::span<const Query> Queries() const = 0;

  /// True if the device has events and the user wants them. Tasks of events then come as often as
  /// fast polls, and again as soon as a batch is saved. Called whenever Queries() is.
  virtual bool HasEvents() const { return false; }

  /// Returns the earliest time of the next background task; empty: none is wanted. Background tasks
  /// run when no other job of the line is due soon, at least once a minute, and never while a batch
  /// is unsaved. Called after each task, and when a batch has been saved.
  virtual std::optional<Instant> BackgroundDue() const { return std::nullopt; }

  /// `said` is EventBatch::said of the newest saved batch of events; empty: none is saved. Called
  /// when the event store has been opened (with the batch from before a restart) and whenever a
  /// batch is saved; HasEvents is called afterwards. A conversation with a device that never
  /// deletes events uses this to find out which events are already delivered, and returns false
  /// from HasEvents until the first call.
  virtual void OnEventsKept(std::string_view /*said*/) {}

  /// Returns the next request for `task`. A request that the task does not name is allowed, such as
  /// a login; its Answer then returns ask_again. The returned request may never be sent: it may
  /// wait behind a probe or for a busy device, after which Ask is called again or the task ends
  /// without a call. So a conversation must count requests in OnFrame, OnSent and OnFailure, not
  /// here. An error, one sentence, ends the task as unsupported: the value cannot be written.
  virtual Result<Request> Ask(const Task& task, Instant now) = 0;

  /// Returns how many of these writes, from the first on, fit in one exchange: 2 for
  /// "1WS4:0.9/S5:1.2".
  virtual std::size_t WritesTogether(std::span<const PointValue> writes) const {
    return std::min<std::size_t>(writes.size(), 1);
  }

  /// Called for a whole frame that answers `request` according to Check: an ok reply, or a refusal.
  virtual Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) = 0;

  /// Called when `request`, a broadcast (Expectation::Reply::none), has been sent. ask_again: the
  /// task continues, and Ask is called for its next request.
  virtual Then OnSent(const Task&, const Request&, Instant) { return Then::done; }

  /// Called when a stamped request is about to be sent: writes the time into its bytes, whose
  /// number must not change. `arrives`: when the last byte will have been sent; `character`: the
  /// duration of one character on this line.
  virtual void Stamp(Request&, Now /*arrives*/, Duration /*character*/) {}

  /// Tells whether this machine's clock is synchronised. Before the first call it counts as not
  /// synchronised.
  virtual void OnHostClock(bool /*right*/) {}

  /// Called when `request` has failed and is not repeated any more. The outcome is the cause:
  /// no_reply, partial, corrupt, unexpected; or busy: the request was not sent, because its time
  /// was over or it was forbidden. ask_again: another exchange must close what is open. Also called
  /// after an OnFrame that gave a batch, if the reply may belong to another request: the batch is
  /// then discarded. Not called if the port is lost: OnReconnect follows instead.
  virtual Then OnFailure(const Task&, const Request&, Outcome, Instant) { return Then::done; }

  /// Returns the request to send before a failed request is repeated, or instead of a request that
  /// is not repeatable. Examples: a DCON broadcast that is due; SPA command B, which returns the
  /// last answer to L again, because L removes events from the device. Empty: the request is
  /// repeated, or the exchange has failed.
  virtual std::optional<Request> Instead(const Request&, Outcome, Instant) { return std::nullopt; }

  /// Not null: the device sends unasked; the result never changes. Silence of such a device is no
  /// failure: it is asked only Queries(), which may be empty.
  virtual const Standing* Listens() const { return nullptr; }
  /// Called for a whole message that came unasked. Readings and events are stored like those of a
  /// reply. An outcome other than ok counts the message as damaged. `said` of its batch is not
  /// compared with earlier batches: every batch is saved, and OnEventsKept is called for each.
  /// `received`: the time of its last byte.
  virtual Answer OnUnasked(View /*message*/, Now /*received*/) { return {}; }
  /// Returns when OnDue must be called; empty: not before the next message. Called after each
  /// OnUnasked and OnDue.
  virtual std::optional<Instant> DueAt() const { return std::nullopt; }
  virtual Answer OnDue(Now /*now*/) { return {}; }

  /// Called when the port was reopened, or the device has stopped answering. Another device may be
  /// connected now: forget open sessions and everything learned, such as "does not know command 5".
  virtual void OnReconnect() {}

  /// Called when a person has enabled the device: retry what was given up, for example a password
  /// that was refused.
  virtual void OnEnabled() {}

  /// Returns the fault of the whole device. Called after each reply and failure. OnReconnect does
  /// not clear it: the conversation clears it by itself.
  virtual const DeviceTrouble& trouble() const {
    static const DeviceTrouble kNone;
    return kNone;
  }

  /// Returns the text to keep over restarts of the program, one line: "serial 12345". Empty:
  /// nothing to keep. Called after each reply and failure, after OnEnabled and OnUnsettledWrite.
  virtual const std::string& Memory() const {
    static const std::string kNothing;
    return kNothing;
  }
  /// Gets the text of Memory from before the restart, for the same gateway, line, device, protocol,
  /// address and profile; it may be empty. Called before any other function, and never if nothing
  /// can be stored. A text that the conversation cannot parse counts as empty. `now`: for civil
  /// times in the text.
  virtual void Recall(std::string_view /*memory*/, Now /*now*/) {}

  /// Called once if, according to the audit, a write from before a restart has not ended: a session
  /// or a password may still be open in the device. Memory must record this until the device
  /// answers.
  virtual void OnUnsettledWrite() {}

  /// Called when a recent reply on the line belonged to another request, so a recorded refusal may
  /// be wrong. Refused items are asked again. True: Queries() has changed.
  virtual bool ForgetRefusals() { return false; }

  /// Returns the outcome that OnFrame would give, without any effect. The poller calls it before
  /// OnFrame, and for earlier requests, to find out to which request a reply belongs. It may be
  /// stricter than OnFrame and return unexpected, for example for a text where a number was asked
  /// for: such a reply is accepted only if no other reply is outstanding.
  virtual Outcome Check(View request, View frame) const = 0;

  /// Returns the meaning of a reply: for `baudgate decode`, for routed requests, and for a frame
  /// whose task no longer exists. Checks and readings are those of OnFrame, but no state changes.
  /// An item without a point gets a label.
  virtual Answer Interpret(View request, View frame) = 0;

  /// Returns the minimum times that the device itself has reported; empty: none. The longer of
  /// these and the configured times apply. `character`: the duration of one character on its line.
  /// Called whenever trouble() is.
  virtual config::Timing LeastTimes(Duration character) const {
    static_cast<void>(character);
    return {};
  }

  /// For the status: what was learned about how to ask this device, such as "at most 4 items in one
  /// request". Empty: nothing.
  virtual std::string WhatIsLearned() const { return {}; }
  /// For the status of a device that sends unasked: items that points need but that never came,
  /// with a remedy, such as "no MDA comes: switch it on at the device". Empty: nothing.
  virtual std::string WhatIsMissing() const { return {}; }
  /// True if the device's clock should be set, but this machine's clock is not synchronised.
  virtual bool LacksTime() const { return false; }
};

}  // namespace baudgate::protocols
