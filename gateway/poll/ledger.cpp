// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/ledger.h"

#include <algorithm>
#include <utility>

namespace baudgate {
namespace {

/// Line use is not worth a word before.
constexpr Duration kShortestUse = 10s;
/// So many outages in so many minutes are a habit.
constexpr std::uint32_t kFlapping = 3;
constexpr std::size_t kFlappingMinutes = 5;

}  // namespace

Ledger::Ledger(const Roster& roster, const Schedule& schedule, PointStore& store,
               std::uint32_t line, PollerListener& listener)
    : roster_(roster), schedule_(schedule), store_(store), line_(line), listener_(listener) {
  for (const auto& device : roster.devices()) ShowTimes(*device);
}

Ledger::State& Ledger::Of(const Member& member) {
  if (states_.size() <= member.place) states_.resize(member.place + 1);
  return states_[member.place];
}

/// A slave that only routes reach stands in no store.
void Ledger::Change(const Member& member, const std::function<void(DeviceStatus&)>& change) {
  if (member.device != nullptr) store_.UpdateStatus(member.index, change);
}

void Ledger::OnTime(Now now, bool busy, const Member* member, bool drains) {
  const Duration passed = now.instant - now_.instant;
  if (open_ && busy) {
    counters_.busy += passed;
    drains ? under_way_.OnDrained(passed) : under_way_.OnExchangeTime(passed);
    if (member != nullptr) Of(*member).busy += passed;
    if (member != nullptr && drains) Of(*member).drained += passed;
  }
  now_ = now;
  if (others_.EndsAt(now.instant)) listener_.OnNews({News::What::collisions, true}, now_);
  if (now.instant - minute_began_ < 1min) return;
  use_ = UseSince(minute_began_);
  shares_ = SharesSince(minute_began_);
  under_way_.Begin();
  minute_began_ = now.instant;
  busy_before_minute_ = counters_.busy;
}

void Ledger::OnOpened() {
  open_ = true;
  use_.reset();
  under_way_.Reset();
  minute_began_ = now_.instant;
  busy_before_minute_ = counters_.busy;
  silent_from_.reset();
  for (State& state : states_) state.heard = now_.instant;
}

void Ledger::OnClosed(Override why) {
  open_ = false;
  closed_as_ = why;
  use_ = 0;
  const std::string reason = WhyClosed();
  for (const auto& device : roster_.devices()) {
    ShowOverride(*device);
    if (!device->in_use) continue;
    // Behind a closed port nothing is online. The log has one line for the port, not one a device;
    // the first answer after it opens is news again.
    State& state = Of(*device);
    if (state.shown != DeviceState::never_seen) state.shown = DeviceState::offline;
    Change(*device, [&](DeviceStatus& status) {
      status.state = state.shown;
      status.last_outcome = Outcome::line_down;
      status.last_reason = reason;
    });
  }
}

std::string Ledger::WhyClosed() const {
  return closed_as_ == Quality::bad_out_of_service ? "the port is lent to another program"
                                                   : "the port is closed";
}

void Ledger::OnSent(const Member& member, const Request& request) {
  counters_.bytes_out += request.bytes.size();
  if (tap_ != nullptr) tap_->OnSent(member.index, request, now_);
}

void Ledger::OnReceived(View bytes) {
  counters_.bytes_in += bytes.size();
  if (tap_ != nullptr) tap_->OnReceived(bytes, now_);
}

void Ledger::OnRing(const Member& member, bool cut) {
  if (cut == cut_since_.has_value()) return;
  cut_since_ = cut ? std::optional(now_.wall) : std::nullopt;
  listener_.OnNews({News::What::ring_open, !cut}, now_);
  listener_.OnWarning(member.index,
                      cut ? "the line does not echo any more: its ring is open, or a device on it "
                            "has no power; until it is mended no device of the line can answer"
                          : "the line echoes again: its ring is closed");
}

void Ledger::OnSecondMaster() {
  if (!others_.Add(now_.instant)) return;
  listener_.OnNews({.what = News::What::collisions,
                    .text = "echoes differ from what was sent: another master speaks on the line"},
                   now_);
}

void Ledger::OnPatience(const Member& member, Duration more) {
  more = std::chrono::floor<std::chrono::milliseconds>(more);
  Duration& known = Of(member).patience;
  if (std::exchange(known, more) == more) return;
  Change(member, [more](DeviceStatus& status) { status.patience = more; });
}

void Ledger::OnLags(const Member& member, bool lags) {
  if (!lags && Of(member).behind == 0) return;
  const std::uint32_t behind = lags ? Of(member).behind + 1 : 0;
  Of(member).behind = behind;
  Change(member, [behind](DeviceStatus& status) { status.behind = behind; });
}

void Ledger::OnLate(const Member& member, Duration lateness) {
  ++counters_.late;
  Change(member, [lateness](DeviceStatus& status) {
    ++status.late;
    status.lateness = std::max(status.lateness, lateness);
  });
}

void Ledger::OnSecondReply(const Member& member) {
  Change(member, [](DeviceStatus& status) { ++status.doubled; });
  if (std::exchange(Of(member).told_second, true)) return;
  listener_.OnWarning(member.index,
                      "a second, different reply came behind the first: replies come twice, or one "
                      "request late; the values read just before are read again");
}

void Ledger::OnRetry(const Member& member) {
  Change(member, [this](DeviceStatus& status) {
    ++status.retries;
    ++status.hour.At(now_.instant).repeats;
  });
}

void Ledger::OnWrite(const Member& member, WriteEnd end, bool read_back) {
  Change(member, [end, read_back](DeviceStatus& status) {
    ++status.writes[static_cast<std::size_t>(end)];
    if (end == WriteEnd::ok && !read_back) ++status.unread_writes;
  });
}

void Ledger::OnRecheck(const Member& member) {
  Change(member, [](DeviceStatus& status) { ++status.rechecks; });
}

void Ledger::OnUnsupported(const Member& member, const std::string& reason) {
  Change(member, [&reason](DeviceStatus& status) {
    status.last_outcome = Outcome::unsupported;
    status.last_reason = reason;
  });
}

/// Devices that have not been asked for long count as well.
void Ledger::CountMissed() {
  for (const auto& device : roster_.devices()) {
    const std::uint32_t missed = schedule_.Missed(device->place, now_.instant);
    const std::uint32_t before = std::exchange(Of(*device).missed, missed);
    if (before == missed) continue;
    Change(*device, [&](DeviceStatus& status) {
      status.missed = missed;
      if (missed > before) status.hour.At(now_.instant).missed += missed - before;
    });
  }
}

void Ledger::OnExchange(const Member& member, const ExchangeEnd& end, const Finding& finding,
                        bool mute, bool probe, bool routed, LineUse use) {
  const bool answered = ProvesLife(end.outcome) && !mute;
  under_way_.OnEnd(ProvesLife(end.outcome) ? use : LineUse::silence);
  Of(member).symptom = finding.symptom;
  const Outcome outcome = routed && ProvesLife(end.outcome) ? Outcome::ok : end.outcome;
  CountMissed();
  ++counters_.exchanges;
  ++counters_.outcomes[static_cast<std::size_t>(end.outcome)];
  if (answered) {
    counters_.round_trips.Add(end.round_trip);
    silent_from_.reset();
  } else if (!ProvesLife(end.outcome) && end.outcome != Outcome::line_down) {
    if (!silent_from_) silent_from_ = now_.instant;
    last_failure_ = now_.instant;
  }
  Change(member, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(outcome)];
    status.last_outcome = outcome;
    if (!probe) status.recent.Add(outcome);
    status.busy = Of(member).busy;
    if (outcome != Outcome::ok) status.last_reason = end.reason;
    status.learned = member.device->conversation->WhatIsLearned();
    if (!mute && end.outcome != Outcome::line_down) {
      status.findings.Add(finding);
      Count(member, answered, status);
    }
    if (!answered) return;
    status.last_ok = now_.instant;
    status.last_ok_wall = now_.wall;
    status.round_trips.Add(end.round_trip);
  });
  if (tap_ != nullptr) tap_->OnExchangeEnd(member.index, end, now_);
}

/// What its exchange adds to the minute under way.
void Ledger::Count(const Member& member, bool answered, DeviceStatus& status) {
  State& state = Of(member);
  MinuteCounts& tally = status.hour.At(now_.instant);
  const Duration drained = std::exchange(state.drained, {});
  const Duration took = state.busy - std::exchange(state.counted, state.busy) - drained;
  if (state.heard == Instant{}) state.heard = now_.instant;
  const Duration since = now_.instant - std::exchange(state.heard, now_.instant);
  ++(answered ? tally.answered : tally.failed);
  (answered ? tally.up : tally.down) += since;
  (answered ? tally.served : tally.wasted) += took;
  tally.wasted += drained;
  if (answered) state.out = false;
}

void Ledger::OnMore(const Member& member, const Finding& finding, std::size_t back) {
  if (back == 0) Of(member).symptom = finding.symptom;
  Change(member, [&](DeviceStatus& status) { status.findings.Amend(finding, back); });
}

void Ledger::OnCutOff(const Member& member, const Finding& finding) {
  if (finding.bytes == 0) return;
  Change(member, [&](DeviceStatus& status) { status.findings.Add(finding); });
}

void Ledger::OnTask(const Member& member, bool answered) {
  const bool begins = !answered && !std::exchange(Of(member).out, true);
  if (!begins) return;
  Change(member, [this](DeviceStatus& status) { ++status.hour.At(now_.instant).outages; });
}

void Ledger::OnPoll(const Device& device, std::size_t query, bool answered) {
  const auto queries = device.conversation->Queries();
  if (query >= queries.size()) return;
  const Symptom symptom = Of(device).symptom;
  Change(device, [&](DeviceStatus& status) {
    status.queries.resize(queries.size());
    QueryCount& count = status.queries[query];
    const auto& points = queries[query].points;
    count.first_point = points.empty() ? 0 : points.front();
    count.points = points.size();
    count.in_vain = answered ? 0 : count.in_vain + 1;
    count.failures = static_cast<std::uint8_t>(count.failures << 1U | (answered ? 0U : 1U));
    count.refused = symptom == Symptom::refusal ? count.refused + 1 : 0;
    count.symptom = symptom;
  });
}

void Ledger::OnSpeaks(const Member& member) {
  Change(member, [](DeviceStatus& status) { status.unasked = true; });
}

void Ledger::OnUnasked(const Member& member, Outcome outcome, const std::string& reason,
                       const Finding& finding) {
  ++counters_.exchanges;
  ++counters_.outcomes[static_cast<std::size_t>(outcome)];
  Change(member, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(outcome)];
    status.last_outcome = outcome;
    status.recent.Add(outcome);
    status.findings.Add(finding);
    status.learned = member.device->conversation->WhatIsLearned();
    if (outcome != Outcome::ok) {
      status.last_reason = reason;
      return;
    }
    status.last_ok = now_.instant;
    status.last_ok_wall = now_.wall;
  });
}

void Ledger::OnLostEvents(const Member& member, std::size_t events) {
  Change(member, [events](DeviceStatus& status) {
    status.lost_events += static_cast<std::uint32_t>(events);
  });
}

void Ledger::OnFastPoll(const Member& member, Duration wire, bool answered, bool last_of_round) {
  State& state = Of(member);
  state.round_wire += wire;
  state.round_clean = state.round_clean && answered;
  if (!last_of_round) return;
  const Duration took = std::exchange(state.round_wire, {});
  if (!std::exchange(state.round_clean, true)) return;
  state.fast_wire = took;
  MeasureCycle();
}

void Ledger::OnPlan(const Device& device) {
  Of(device).round_wire = {};
  Of(device).round_clean = true;
  Change(device, [](DeviceStatus& status) { status.queries.clear(); });
}

void Ledger::MeasureCycle() {
  Duration cycle{};
  for (const auto& device : roster_.devices()) {
    if (device->in_use && !device->health.offline()) cycle += Of(*device).fast_wire;
  }
  for (const auto& device : roster_.devices()) {
    store_.SetLineCycle(device->index, cycle, now_.instant);
  }
}

bool Ledger::OnTrouble(const Device& device) {
  const Reason reason = device.conversation->trouble().reason;
  const std::string& text = device.conversation->trouble().text;
  State& state = Of(device);
  if (text == state.trouble) return false;
  const bool over = state.in_trouble && reason == Reason::none;
  state.in_trouble = reason != Reason::none;
  state.trouble = text;
  ShowOverride(device);
  Change(device, [&text](DeviceStatus& status) { status.trouble = text; });
  listener_.OnNews({News::What::wrong_device, text.empty(), device.index, text}, now_);
  listener_.OnWarning(device.index, text.empty() ? "it is what it should be again" : text);
  return over;
}

void Ledger::ShowTimes(const Device& device) {
  Change(device, [&](DeviceStatus& status) { status.timing = device.timing; });
}

void Ledger::OnMemory(Device& device) {
  const std::string& memory = device.conversation->Memory();
  if (memory == device.memory) return;
  device.memory = memory;
  listener_.OnMemory(device.index, memory);
}

void Ledger::OnReplaced(const Member& member) {
  const std::string text =
      "it tells another name than before: another device answers here, and everything is read anew";
  listener_.OnNews({.what = News::What::replaced, .device = member.index, .text = text}, now_);
  listener_.OnWarning(member.index, text);
}

/// Its outage is no judgement of how it works when it is back.
void Ledger::OnOffline(const Member& member) {
  Change(member, [](DeviceStatus& status) { status.recent = {}; });
}

void Ledger::OnState(const Member& member, const std::string& reason) {
  const DeviceState state = StateOf(member);
  const DeviceState from = std::exchange(Of(member).shown, state);
  ShowOverride(member);
  if (state == from) return;
  Change(member, [&](DeviceStatus& status) {
    status.state = state;
    // Its outage is no judgement of how it works when it is back, unless it comes and goes.
    const bool back = Answers(state) && !Answers(from);
    if (back && status.hour.Sum(now_.instant, kFlappingMinutes).outages < kFlapping) {
      status.findings = {};
    }
  });
  listener_.OnDeviceState(member.index, from, state, reason, now_);
  if (tap_ != nullptr) tap_->OnDeviceState(member.index, state, reason, now_);
}

DeviceState Ledger::StateOf(const Member& member) const {
  if (!member.in_use) return DeviceState::disabled;
  const DeviceState state = member.health.state();
  return open_ || state == DeviceState::never_seen ? state : DeviceState::offline;
}

Override Ledger::OverrideOf(const Member& member) const {
  if (!member.in_use) return Quality::bad_out_of_service;
  if (!open_) return closed_as_;
  if (member.health.state() == DeviceState::offline) return Quality::bad_communication;
  const Device* const device = member.device;
  if (device == nullptr || !device->conversation->trouble()) return std::nullopt;
  return QualityOfDevice(device->conversation->trouble().reason);
}

void Ledger::ShowOverride(const Member& member) {
  if (member.device != nullptr) store_.SetOverride(member.index, OverrideOf(member));
}

/// What the line was busy with of the minute under way.
double Ledger::UseSince(Instant began) const {
  const Duration whole = now_.instant - began;
  if (whole < kShortestUse) return 0;
  return static_cast<double>((counters_.busy - busy_before_minute_).count()) /
         static_cast<double>(whole.count());
}

LineShares Ledger::SharesSince(Instant began) const {
  const Duration whole = now_.instant - began;
  return whole < kShortestUse ? LineShares{} : under_way_.SharesOf(whole);
}

void Ledger::ShowLine(Duration notice_bound) {
  store_.UpdateLine(line_, [&](LineStatus& status) {
    static_cast<LineCounters&>(status) = counters_;
    status.spent = under_way_.spent();
    status.use = use_ ? *use_ : UseSince(minute_began_);
    status.minute = use_ ? shares_ : SharesSince(minute_began_);
    status.notice_bound = notice_bound;
    status.cut_since = cut_since_;
  });
}

}  // namespace baudgate
