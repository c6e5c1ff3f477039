// The accounts of a line: what its time went to, how exchanges ended, which states devices are in.
// Told by gateway/poll/poller.cpp; writes the point store, and tells listener and tap of states.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/poll/burst.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/line_minute.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/schedule.h"
#include "gateway/store/line_status.h"
#include "gateway/store/point_store.h"
#include "gateway/trace/tap.h"

namespace baudgate {

class Ledger {
 public:
  Ledger(const Roster& roster, const Schedule& schedule, PointStore& store, std::uint32_t line,
         PollerListener& listener);

  void Attach(Tap& tap) { tap_ = &tap; }

  /// Time has passed; `busy`: the line was, with `member` where that is known. `drains`: it kept
  /// silence behind an exchange of that.
  void OnTime(Now now, bool busy, const Member* member, bool drains = false);
  void OnOpened();
  /// `why`: of all points while the port is closed.
  void OnClosed(Override why);
  /// "the port is closed", or why.
  std::string WhyClosed() const;

  void OnSent(const Member& member, const Request& request);
  void OnReceived(View bytes);
  void OnEcho() { ++counters_.echoes; }
  void OnCollision() { ++counters_.collisions; }
  void OnNegotiation() { ++counters_.negotiations; }
  /// An echo was there, and differed: somebody else has spoken.
  void OnSecondMaster();
  /// `cut`: the bus has stopped echoing (gateway/line/echo_watch.h), as `member` was asked.
  void OnRing(const Member& member, bool cut);
  void OnProbe() { ++counters_.probes; }
  void OnStray(std::size_t count) { counters_.stray_bytes += count; }
  void OnLate(const Member& member, Duration lateness);
  /// It is waited for so much longer.
  void OnPatience(const Member& member, Duration more);
  /// Its replies come a request late, or do no more.
  void OnLags(const Member& member, bool lags);
  void OnSecondReply(const Member& member);
  void OnRetry(const Member& member);
  /// A command has ended; `read_back`: the device shows what was written.
  void OnWrite(const Member& member, WriteEnd end, bool read_back);
  /// A reading does not count before a second one agrees.
  void OnRecheck(const Member& member);
  /// The conversation would not ask.
  void OnUnsupported(const Member& member, const std::string& reason);
  /// `mute`: its end says nothing about the member. `probe`: whether a member is back that is
  /// offline. `routed`: a client has asked, and what it is refused says nothing about the member.
  /// `use`: what it was for.
  void OnExchange(const Member& member, const ExchangeEnd& end, const Finding& finding, bool mute,
                  bool probe, bool routed = false, LineUse use = LineUse::polls);
  /// The device speaks unasked.
  void OnSpeaks(const Member& member);
  /// It has said something, and this is what became of it.
  void OnUnasked(const Member& member, Outcome outcome, const std::string& reason,
                 const Finding& finding);
  /// More has come behind its last exchange, or behind the one that is `back` before it: that looks
  /// otherwise now.
  void OnMore(const Member& member, const Finding& finding, std::size_t back = 0);
  /// The connection has ended with its exchange: whoever ended it may have said why.
  void OnCutOff(const Member& member, const Finding& finding);
  /// A task has ended, all its repeats included.
  void OnTask(const Member& member, bool answered);
  /// A poll has.
  void OnPoll(const Device& device, std::size_t query, bool answered);
  void OnLostEvents(const Member& member, std::size_t events);
  /// A poll of the fast group has ended after so much line time. Failures, retries and waiting say
  /// nothing about how long a round takes: an outage must not make old values look younger.
  void OnFastPoll(const Member& member, Duration wire, bool answered, bool last_of_round);
  /// Its queries are others now.
  void OnPlan(const Device& device);
  /// Its state may have changed; `reason`: what has led to that.
  void OnState(const Member& member, const std::string& reason);
  /// The line time of one fast round of all devices that are polled: one of them has come or gone.
  void MeasureCycle();
  void OnOffline(const Member& member);
  /// What is wrong with it as a whole may be another thing than before. True: nothing is any more.
  bool OnTrouble(const Device& device);
  void ShowTimes(const Device& device);
  /// What the conversation wants to know after a restart may have changed.
  void OnMemory(Device& device);
  /// Another device answers in its place.
  void OnReplaced(const Member& member);

  /// `notice_bound`: see LineStatus.
  void ShowLine(Duration notice_bound);
  void ShowOverride(const Member& member);

  const LineCounters& counters() const { return counters_; }
  /// What was asked since `when` has remained without an answer: a serial server may hang although
  /// its TCP lives.
  bool SilentSince(Instant when) const {
    return silent_from_ && *silent_from_ < when && last_failure_ >= when;
  }

 private:
  struct State {
    DeviceState shown = DeviceState::never_seen;
    Duration busy{};                   // line time that it has taken
    Duration counted{};                // of that, in the status
    Duration drained{};                // line time of the silence behind its last exchange
    Instant heard{};                   // end of its last exchange, or when the port was opened
    bool out = false;                  // its last task has failed
    Symptom symptom = Symptom::clean;  // of its last exchange
    std::uint32_t missed = 0;          // of its periods
    bool round_clean = true;           // nothing has failed in the fast round under way
    Duration round_wire{};             // its line time so far
    Duration fast_wire{};              // of its last whole fast round
    std::string trouble;               // what is wrong with it as a whole, or worth a remark
    bool in_trouble = false;           // the former
    Duration patience{};               // as the status has it
    std::uint32_t behind = 0;          // likewise
    bool told_second = false;          // the user has been warned of a second, different reply
  };

  State& Of(const Member& member);
  void Change(const Member& member, const std::function<void(DeviceStatus&)>& change);
  void CountMissed();
  void Count(const Member& member, bool answered, DeviceStatus& status);
  double UseSince(Instant began) const;
  LineShares SharesSince(Instant began) const;
  DeviceState StateOf(const Member& member) const;
  Override OverrideOf(const Member& member) const;

  const Roster& roster_;
  const Schedule& schedule_;
  PointStore& store_;
  const std::uint32_t line_;
  PollerListener& listener_;
  Tap* tap_ = nullptr;
  std::deque<State> states_;  // by place
  LineCounters counters_;
  Now now_{};
  bool open_ = false;
  Override closed_as_ = Quality::bad_not_connected;
  std::optional<WallTime> cut_since_;  // the ring
  Burst others_;                       // echoes that differed
  Instant minute_began_{};
  Duration busy_before_minute_{};
  LineMinute under_way_;
  LineShares shares_{};                 // as use_
  std::optional<double> use_;           // of the last full minute; nothing before there is one
  std::optional<Instant> silent_from_;  // nobody has answered since
  Instant last_failure_{};              // of an exchange
};

}  // namespace baudgate
