// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/counters/accounts.h"

#include <algorithm>
#include <utility>

namespace baudgate::bus {

/// Changes the status of a device. Does nothing for a slave that only routes reach, because such a
/// slave has no status in the point store.
void DeviceAccounts::Change(const Member& member,
                            const std::function<void(DeviceStatus&)>& change) {
  if (member.device != nullptr) store_.UpdateStatus(member.index, change);
}

void DeviceAccounts::OnTime(Now now, const Member* member, Duration took, bool drains) {
  now_ = now;
  if (member == nullptr) return;
  Entry& entry = entries_[*member];
  entry.busy += took;
  if (drains) entry.drained += took;
}

void DeviceAccounts::OnOpened() {
  for (Entry& entry : entries_) entry.heard = now_.instant;
}

// ---------------------------------------------------------------- after an exchange

void DeviceAccounts::OnExchange(const EndedExchange& ended, Now now) {
  const Member& member = *ended.member;
  const ExchangeEnd& end = ended.end;
  const bool life = ended.answered();
  const bool answered = life && !ended.broadcast;
  const bool cut_off = ended.cut_off();
  // Probes of an offline device do not count among the recent outcomes: nearly all of them fail.
  const bool looks = ended.asked.probe && member.health.absent();
  const Outcome outcome = ended.routed && life ? Outcome::ok : end.outcome;
  ShowPatience(member, ended.patience);
  ShowLag(member, ended.lags);
  CountMissed();
  Change(member, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(outcome)];
    status.last_outcome = outcome;
    if (!looks && !cut_off) status.recent.Add(outcome);
    status.busy = entries_[member].busy;
    if (outcome != Outcome::ok) status.last_reason = end.reason;
    status.learned = member.device->conversation->WhatIsLearned();
    status.lacks_time = member.device->conversation->LacksTime();
    if (!ended.broadcast && !cut_off) Count(member, answered, status);
    if (!answered) return;
    status.last_ok = now.instant;
    status.last_ok_wall = now.wall;
    status.round_trips.Add(end.round_trip);
  });
}

/// Updates the number of skipped polls of every device, not only of the device that was asked.
void DeviceAccounts::CountMissed() {
  for (const auto& device : roster_.devices()) {
    const std::uint32_t missed = schedule_.Missed(device->place, now_.instant);
    const std::uint32_t before = std::exchange(entries_[*device].missed, missed);
    if (before == missed) continue;
    Change(*device, [&](DeviceStatus& status) {
      status.missed = missed;
      if (missed > before) status.hour.At(now_.instant).missed += missed - before;
    });
  }
}

void DeviceAccounts::Count(const Member& member, bool answered, DeviceStatus& status) {
  Entry& entry = entries_[member];
  MinuteCounts& tally = status.hour.At(now_.instant);
  const Duration drained = std::exchange(entry.drained, {});
  const Duration took = entry.busy - std::exchange(entry.counted, entry.busy) - drained;
  if (entry.heard == Instant{}) entry.heard = now_.instant;
  const Duration since = now_.instant - std::exchange(entry.heard, now_.instant);
  ++(answered ? tally.answered : tally.failed);
  if (answered || status.last_outcome == Outcome::no_reply) {
    status.failures.Add(answered, now_.instant);
  }
  status.spoilt.Add(answered, now_.instant);
  (answered ? tally.up : tally.down) += since;
  (answered ? tally.served : tally.wasted) += took;
  tally.wasted += drained;
  if (answered) entry.out = false;
}

void DeviceAccounts::OnUnsupported(const Member& member, const std::string& reason) {
  Change(member, [&reason](DeviceStatus& status) {
    status.last_outcome = Outcome::unsupported;
    status.last_reason = reason;
  });
}

void DeviceAccounts::OnRetry(const Member& member) {
  Change(member, [this](DeviceStatus& status) {
    ++status.retries;
    ++status.hour.At(now_.instant).repeats;
  });
}

void DeviceAccounts::OnRecheck(const Member& member) {
  Change(member, [](DeviceStatus& status) { ++status.rechecks; });
}

void DeviceAccounts::OnUnconfirmed(const Member& member) {
  Change(member, [](DeviceStatus& status) { ++status.unconfirmed; });
}

void DeviceAccounts::OnLate(const Member& member, Duration lateness, Duration patience) {
  ShowPatience(member, patience);
  Change(member, [lateness](DeviceStatus& status) {
    ++status.late;
    status.lateness = std::max(status.lateness, lateness);
  });
}

void DeviceAccounts::ShowPatience(const Member& member, Duration more) {
  more = std::chrono::floor<std::chrono::milliseconds>(more);
  Duration& known = entries_[member].patience;
  if (std::exchange(known, more) == more) return;
  Change(member, [more](DeviceStatus& status) { status.patience = more; });
}

void DeviceAccounts::ShowLag(const Member& member, bool lags) {
  std::uint32_t& known = entries_[member].behind;
  if (!lags && known == 0) return;
  known = lags ? known + 1 : 0;
  Change(member, [behind = known](DeviceStatus& status) { status.behind = behind; });
}

void DeviceAccounts::OnSecondReply(const Member& member) {
  Change(member, [this](DeviceStatus& status) {
    ++status.doubled;
    status.last_doubled = now_.instant;
  });
  if (std::exchange(entries_[member].told_second, true)) return;
  listener_.OnWarning(member.index,
                      "two different replies came to one request, so the gateway reads the values "
                      "again; if this goes on, 'baudgate status' shows the cause");
}

// ---------------------------------------------------------------- after a task

void DeviceAccounts::OnTask(const Member& member, bool answered) {
  const bool begins = !answered && !std::exchange(entries_[member].out, true);
  if (!begins) return;
  Change(member, [this](DeviceStatus& status) { ++status.hour.At(now_.instant).outages; });
}

void DeviceAccounts::OnPoll(const Device& device, std::size_t query, bool answered, bool missed) {
  const auto queries = device.conversation->Queries();
  if (query >= queries.size()) return;
  Change(device, [&](DeviceStatus& status) {
    status.queries.resize(queries.size());
    QueryCount& count = status.queries[query];
    const auto& points = queries[query].points;
    count.first_point = points.empty() ? 0 : points.front();
    count.points = points.size();
    count.in_vain = answered ? 0 : count.in_vain + 1;
    count.failures = static_cast<std::uint8_t>(static_cast<unsigned>(count.failures) << 1U |
                                               (missed || !answered ? 1U : 0U));
  });
}

/// The conversation has changed its queries. If one query failed at least twice in a row while
/// another was answered, the device rejects that query and was not out of order. Then its failures,
/// and its outages of this minute and the minute before, are removed from the status.
void DeviceAccounts::OnPlan(const Device& device) {
  constexpr std::uint32_t kNever = 2;
  Change(device, [this](DeviceStatus& status) {
    const auto& queries = status.queries;
    const bool learned =
        std::ranges::any_of(queries, [](const auto& query) { return query.in_vain >= kNever; }) &&
        std::ranges::any_of(queries, [](const auto& query) { return query.in_vain == 0; });
    if (learned) {
      status.failures = {};
      status.spoilt = {};
      for (const Instant when : {now_.instant - 1min, now_.instant}) {
        status.hour.At(when).outages = 0;
      }
    }
    status.queries.clear();
  });
}

void DeviceAccounts::OnWrite(const Member& member, WriteEnd end, bool read_back) {
  Change(member, [end, read_back](DeviceStatus& status) {
    ++status.writes.ends[static_cast<std::size_t>(end)];
    if (end == WriteEnd::ok && !read_back) ++status.writes.not_read_back;
  });
}

/// Clears the recent outcomes, so that the device is judged by its exchanges after the outage only.
void DeviceAccounts::OnOffline(const Member& member) {
  Change(member, [](DeviceStatus& status) { status.recent = {}; });
}

// ---------------------------------------------------------------- messages that come unasked

void DeviceAccounts::OnSpeaks(const Member& member) {
  Change(member, [](DeviceStatus& status) { status.unasked = true; });
}

void DeviceAccounts::OnUnasked(const Member& member, Outcome outcome, const std::string& reason) {
  Change(member, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(outcome)];
    status.last_outcome = outcome;
    status.recent.Add(outcome);
    status.learned = member.device->conversation->WhatIsLearned();
    status.missing = member.device->conversation->WhatIsMissing();
    if (outcome != Outcome::ok) {
      status.last_reason = reason;
      return;
    }
    status.last_ok = now_.instant;
    status.last_ok_wall = now_.wall;
  });
}

void DeviceAccounts::OnLostEvents(const Member& member, std::size_t events) {
  Change(member, [events](DeviceStatus& status) {
    status.lost_events += static_cast<std::uint32_t>(events);
  });
}

void FastRounds::OnPoll(const Member& member, const Poll& poll, Instant now) {
  Entry& entry = entries_[member];
  entry.wire += poll.wire;
  entry.clean = entry.clean && poll.answered;
  if (!poll.last_of_round) return;
  const Duration took = std::exchange(entry.wire, {});
  if (!std::exchange(entry.clean, true)) return;
  entry.last = took;
  Measure(now);
}

void FastRounds::OnPlan(const Device& device) {
  Entry& entry = entries_[device];
  entry.wire = {};
  entry.clean = true;
}

void FastRounds::Measure(Instant now) const {
  Duration cycle{};
  for (const auto& device : roster_.devices()) {
    if (device->in_use && !device->health.absent()) cycle += entries_[*device].last;
  }
  for (const auto& device : roster_.devices()) store_.SetLineCycle(device->index, cycle, now);
}

}  // namespace baudgate::bus
