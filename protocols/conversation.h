// The contract of conversations. A conversation knows one device: which requests read its points,
// what to send for a write, and what the replies mean. gateway/bus/jobs/job.h drives it, one
// exchange after another, on the thread of its line. It has no thread, socket or clock of its own
// and writes no log. docs: protocols/README.md, "Conversations".
//
// A poll of one query, in calls:
//   Queries()                → {{fast, {0, 1}}, {slow, {2}}}    points 0 and 1 share one request
//   Ask({poll, query 0})     → Request "01 03 00 00 00 02 C4 0B"
//   OnFrame(…, "01 03 04 …") → Answer {ok, readings {0: 235, 1: 17}}
// When no good frame came, the poller repeats the request. When that has failed as well, it calls
// OnFailure in place of OnFrame.
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

/// In place of an index into a device's points: none of them.
inline constexpr std::size_t kNoPoint = std::numeric_limits<std::size_t>::max();

/// The most exchanges of a task, broadcasts included. A task that asks for more ends as unexpected.
inline constexpr int kMostSteps = 10;

/// Points that one request reads together.
struct Query {
  config::Group group = config::Group::fast;  ///< of all its points: how often it is asked
  std::vector<std::size_t> points{};          ///< indices into the device's points
};

struct PointValue {
  std::size_t point = kNoPoint;  ///< a point that may be written
  Value value{};                 ///< raw, scale and offset are already taken out
};

/// What the gateway wants of a device. Mostly one exchange; several if a session must be opened
/// first, or a password closed after a write.
struct Task {
  enum class Kind : std::uint8_t {
    poll,        ///< read Queries()[query]
    probe,       ///< find out with one short exchange whether the device is there
    write,       ///< write `value` to `point`, and leave the device as it was found
    events,      ///< take the events since the last time out of the device
    background,  ///< one low-priority exchange, see Conversation::BackgroundDue
  };
  Kind kind = Kind::poll;
  std::size_t query = 0;         ///< polls only: less than Queries().size()
  std::size_t point = kNoPoint;  ///< writes only: a point that may be written
  Value value{};                 ///< writes only: raw, scale and offset are already taken out
  /// Writes only: further writes in the same exchange. WritesTogether has said that they fit.
  std::vector<PointValue> also{};
};

struct Request {
  Bytes bytes{};  ///< the whole frame, checksum included
  /// What the same task has sent before, if that decides what the reply says: "select channel 3"
  /// before "read". Requests with equal bytes and other contexts are other questions, and a request
  /// with a context is not repeated without it.
  Bytes context{};
  Expectation expect{};
  /// Probes only: the device answers with the same bytes every time, and answers nothing else with
  /// them: its name or serial number, not a measurement. Other bytes come from another device. The
  /// poller uses such replies to find out whether replies still come in the order of the requests.
  bool steady = false;
  /// The reply differs from the replies to all polls of the device, by its length or form, but is
  /// not always the same. Example: a probe that reads three registers, where polls read two.
  bool unlike_polls = false;
  /// The reply is true whichever request it answers, so it does no harm late or twice.
  bool any_order = false;
  /// The reply carries the number of its request, as in Modbus TCP. So one that comes late or twice
  /// on this connection is recognised. The number proves nothing of what is behind the next hop: a
  /// converter may put the present number and unit before a late reply of its serial side.
  bool numbered = false;
  /// Ends what an earlier request has begun, as "close the password" does. It is sent even if the
  /// client has gone or the time for its task is over.
  bool closes = false;
  /// It only makes a write possible, as a password does. When it fails, nothing has been written.
  bool prepares = false;
  /// It tells the time, or asks for it: Conversation::Stamp is called when it is sent.
  bool stamped = false;
  /// The longest time until the first byte of this reply, if that is longer than the device's reply
  /// time. Example: 5 s to clear all parameters, while reads take 500 ms.
  Duration reply{};
  /// The silence that the device needs before this request, if that is longer than usual.
  Duration quiet{};

  bool AsksTheSameAs(const Request& other) const {
    return bytes == other.bytes && context == other.context;
  }
  /// No reply to a poll could pass for the reply to this.
  bool is_proof() const { return steady || unlike_polls || any_order; }
};

/// One value out of a reply, still raw: the gateway applies scale, offset and sentinels.
struct Reading {
  std::size_t point = kNoPoint;  ///< index into the device's points
  Value value{};                 ///< empty: only the quality is known
  Quality quality = Quality::good;
  std::string label{};  ///< if no point fits (`baudgate decode`): the item in the protocol's words
};

/// A time as a device has reported it: "12.345" of a minute is {12345ms, 1min}, a whole date is the
/// time since 1970 and no period. Whether the device's clock is right is not known here.
struct SaidTime {
  Duration time{};
  Duration period{};  ///< the time is known modulo this; zero: it is known whole
};

/// An event that a device reports.
struct DeviceEvent {
  std::uint32_t channel = 0;  ///< 0: the device as a whole
  std::uint32_t code = 0;     ///< the device's own; 0: it cannot be read, only `text` is known
  std::optional<SaidTime> time{};
  std::string text{};  ///< further words of the device; mostly empty
};

/// One value of a PastRecord.
struct PastValue {
  std::string name{};  ///< "active_import"
  Value value{};
  Quality quality = Quality::good;
  std::string unit{};
};

/// Values that a device has measured and kept itself, by its own clock: half an hour of a load
/// profile, the energies at the beginning of a month.
struct PastRecord {
  std::string series{};  ///< "load_1", with values such as "load_1.active_import"; "month"
  Duration begin{};      ///< since 1970
  Duration span{};       ///< zero: its values were read off at one moment, and belong together
  std::vector<PastValue> values{};  ///< none: they are lost
};

/// Events that one reply has taken out of a device, the oldest first. The device forgets them when
/// it is asked for more: the poller does so only when they are saved
/// (gateway/bus/devices/poller_listener.h).
struct EventBatch {
  std::vector<DeviceEvent> events{};
  std::vector<PastRecord> past{};
  std::string said{};    ///< the batch as it came: one that comes twice is recognised by it
  bool again = false;    ///< this may be the last batch again
  bool drained = false;  ///< nothing is left in the device: no event is older than this exchange
};

/// How a task goes on after an exchange.
enum class Then : std::uint8_t {
  done,       ///< it has ended
  ask_again,  ///< call Ask once more with the same task: the next exchange
  replan,     ///< it has ended, and Queries() has changed
  restart,    ///< the same, and all of them are due at once: they read something else now
};

/// What a reply means. The outcome of a task is the outcome of its last Answer. So when a write was
/// refused and a closing exchange follows it, the Answer to the closing exchange says refused
/// again.
struct Answer {
  Outcome outcome = Outcome::ok;
  std::string reason{};  ///< one sentence for the log; empty when ok
  /// What a user can do about it, for `baudgate status`: "look at its display"; empty: of a device
  /// that is busy, to ask it less often; else, to compare it with its profile.
  std::string remedy{};
  std::vector<Reading> readings{};
  /// What stands where a number belongs, and is none: "0,52"; nothing: that does not occur.
  std::optional<std::string> no_number{};
  Then then = Then::done;
  /// A write was refused, but something may have changed: an analog output that went to its limit.
  bool may_have_acted = false;
  Duration wait{};  ///< the device wants no request for this time: "busy, ask me in 2 s"
  /// For tasks of events and tasks in the background. An answer with a batch ends the task.
  std::optional<EventBatch> batch{};
};

/// What is wrong with a device as a whole, by its own words. As long as it is, no value of it is
/// good, whatever its replies say.
struct DeviceTrouble {
  Reason reason = Reason::none;  ///< one that ConcernsDevice; none: its values are good
  std::string text{};  ///< "type 0D, the profile says 08"; without a reason it is a remark

  explicit operator bool() const { return reason != Reason::none; }
};

/// How messages that a device sends unasked are recognised: readers of tags and bar codes, weighing
/// indicators. gateway/bus/exchange/line.h receives them, also during an exchange.
struct Standing {
  FrameRule rule = nullptr;
  Expectation expect{};  ///< reply: standing
  Duration idle{};       ///< silence that ends a message: the rule is asked once more
  Duration whole{};      ///< a message that takes longer from its first byte is damaged
  /// A message is recognised by its beginning. Else it begins where the one before ended, or after
  /// a silence of the line.
  bool marked = false;
};

/// The engine keeps these promises: the device's address, options and points have passed the checks
/// of the Protocol; indices in a Task are valid at Ask and OnFrame; OnFrame and OnFailure follow
/// the Ask or Instead that gave their request; a frame is one that the reply rule took for whole.
/// If Queries() has changed while a reply was awaited, the Task has the new number of its query. If
/// that is gone, Interpret is called in place of OnFrame, and OnFailure names a query that there is
/// not.
class Conversation {
 public:
  virtual ~Conversation() = default;

  /// The requests that read all readable points, in the order of asking. They stay the same until
  /// an Answer or OnFailure says replan or restart, or OnReconnect, ForgetRefusals or Recall is
  /// called.
  virtual std::span<const Query> Queries() const = 0;

  /// The device has events, and the user wants them: tasks of events come as often as fast polls,
  /// and again as soon as a batch is kept. Called whenever Queries() is.
  virtual bool HasEvents() const { return false; }

  /// From when on it wants a task in the background; empty: it wants none. Such tasks come when
  /// nothing else of the line is due soon, at least once a minute, and never while a batch is not
  /// kept yet. Called after each task, and when a batch is kept.
  virtual std::optional<Instant> BackgroundDue() const { return std::nullopt; }

  /// `said` of its newest batch of events on the disk (EventBatch::said); empty: there is none.
  /// Called when the store of events is open, with what it holds from before a restart, and
  /// whenever a batch is kept; HasEvents is asked again after it. For devices that never forget
  /// events: their conversations see by it which ones they have delivered. Until it is called such
  /// a conversation has no events.
  virtual void OnEventsKept(std::string_view /*said*/) {}

  /// The next request for `task`. That may be one which the task itself does not name, such as a
  /// login; then the Answer to it says ask_again. The request may wait, behind a probe or until its
  /// device is no longer busy: then Ask is called for it again, or the task ends without a word. So
  /// what a conversation counts, it counts in OnFrame, OnSent and OnFailure. An error, one
  /// sentence, ends the task as unsupported: the value does not fit what is written.
  virtual Result<Request> Ask(const Task& task, Instant now) = 0;

  /// How many of these writes, from the first on, one exchange carries: "1WS4:0.9/S5:1.2" two.
  virtual std::size_t WritesTogether(std::span<const PointValue> writes) const {
    return std::min<std::size_t>(writes.size(), 1);
  }

  /// A whole frame came that answers `request`, as Check has said: an ok reply, or a refusal.
  virtual Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) = 0;

  /// `request` was a broadcast (Expectation::Reply::none), and is sent. ask_again: the task goes on
  /// after it; what it began with is then the next request.
  virtual Then OnSent(const Task&, const Request&, Instant) { return Then::done; }

  /// A stamped request is sent now: writes its bytes again, as many as before. `arrives`: when the
  /// last of them is out; `character`: the time of one on this line.
  virtual void Stamp(Request&, Now /*arrives*/, Duration /*character*/) {}

  /// Whether this machine's clock is known to be right (synchronised). Before the first call it is
  /// not.
  virtual void OnHostClock(bool /*right*/) {}

  /// `request` has failed, and is not repeated any more. The outcome is why: no_reply, partial,
  /// corrupt, unexpected; busy: the request was not sent, for its time was over or it was
  /// forbidden. ask_again: another exchange closes what is open. Also called after an OnFrame that
  /// gave a batch, if it cannot be known whose reply that was: the batch is not kept. Not called
  /// where the port is lost: then OnReconnect follows.
  virtual Then OnFailure(const Task&, const Request&, Outcome, Instant) { return Then::done; }

  /// What to send before a failed request is repeated, or in place of one that is not repeatable.
  /// Examples: a DCON broadcast that is due; the SPA command L takes events out of the device, B
  /// gives the last answer to L again. Empty: it is repeated, or the exchange has failed.
  virtual std::optional<Request> Instead(const Request&, Outcome, Instant) { return std::nullopt; }

  /// Not null: the device sends unasked. The result does not change. Its silence is then no
  /// failure: only Queries() are asked of it, and there may be none.
  virtual const Standing* Listens() const { return nullptr; }
  /// A whole message has come unasked. Readings and a batch of events are taken as those of a
  /// reply; an outcome that is not ok counts it as damaged. What its batch has `said` is not
  /// compared: every batch is kept, and OnEventsKept is called for each. `received`: its last byte.
  virtual Answer OnUnasked(View /*message*/, Now /*received*/) { return {}; }
  /// When OnDue is to be called next; empty: not before a message has come. Called after each of
  /// the two.
  virtual std::optional<Instant> DueAt() const { return std::nullopt; }
  virtual Answer OnDue(Now /*now*/) { return {}; }

  /// The port was opened again, or the device has stopped answering. Another device may be
  /// connected now: forget open sessions and what was learned, such as "does not know command 5".
  virtual void OnReconnect() {}

  /// A person has taken the device into use: what was given up is tried again, for example a
  /// password that was refused.
  virtual void OnEnabled() {}

  /// Called after each reply and failure. It outlives OnReconnect: the conversation itself clears
  /// it.
  virtual const DeviceTrouble& trouble() const {
    static const DeviceTrouble kNone;
    return kNone;
  }

  /// What is kept over restarts of the program, one line in its own words: "serial 12345". Called
  /// after each reply and failure, after OnEnabled and OnUnsettledWrite. Empty: nothing.
  virtual const std::string& Memory() const {
    static const std::string kNothing;
    return kNothing;
  }
  /// What Memory returned before the restart, for the same gateway, line, device, protocol, address
  /// and profile; it may be empty. Called before anything else, and never if nothing can be kept. A
  /// text that the conversation does not understand counts as empty.
  /// `now`: for civil times in it.
  virtual void Recall(std::string_view /*memory*/, Now /*now*/) {}

  /// A write that was begun before a restart has not ended, as far as the audit knows: a session or
  /// a password may still be open in the device. Called once, so Memory must hold it until the
  /// device answers.
  virtual void OnUnsettledWrite() {}

  /// One of the latest replies on the line was to another request, perhaps a refusal. What was
  /// refused is asked again. True: Queries() has changed.
  virtual bool ForgetRefusals() { return false; }

  /// What the outcome of OnFrame would be, without any effect. The poller calls it before OnFrame,
  /// and for requests that were sent earlier, to find out to which one this reply belongs. It may
  /// be stricter, and return unexpected for a text where a number was asked for: such a reply is
  /// taken only if no other is owed.
  virtual Outcome Check(View request, View frame) const = 0;

  /// What a reply to a request means: for `baudgate decode`, for routed requests, and for a frame
  /// that OnFrame cannot be asked about. The same checks and readings as in OnFrame, but no task
  /// and no memory. What fits no point gets a label.
  virtual Answer Interpret(View request, View frame) = 0;

  /// The times that the device needs at least, as it has reported itself; empty: as configured. The
  /// longer one counts. `character`: the time of one on its line. Called whenever trouble() is.
  virtual config::Timing LeastTimes(Duration character) const {
    static_cast<void>(character);
    return {};
  }

  /// For the status: what was learned of how the device must be asked, such as "at most 4 items in
  /// one request". Empty: nothing.
  virtual std::string WhatIsLearned() const { return {}; }
  /// For the status, of a device that sends unasked: what points read and never came, with a
  /// remedy, such as "no MDA comes: switch it on at the device". Empty: nothing.
  virtual std::string WhatIsMissing() const { return {}; }
  /// It should be told the time, and this machine's clock is not known to be right.
  virtual bool LacksTime() const { return false; }
};

}  // namespace baudgate::protocols
