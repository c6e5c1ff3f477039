// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/schedule.h"

namespace baudgate::bus {

std::size_t Schedule::AddDevice(Duration fast_period, Duration slow_period, Duration daily_period,
                                const std::vector<Duration>& intervals) {
  Device device;
  device.of(config::Group::fast).period = device.rounds[kEvents].period = fast_period;
  device.of(config::Group::slow).period = slow_period;
  device.of(config::Group::daily).period = daily_period;
  device.of(config::Group::again).period = config::kAgainPeriod;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    device.of(config::OwnGroup(i)).period = intervals[i];
  }
  devices_.push_back(std::move(device));
  return devices_.size() - 1;
}

void Schedule::SetQueries(std::size_t index, const std::vector<config::Group>& groups,
                          bool events) {
  Device& device = devices_[index];
  device.before = device.rounds;
  for (Round& round : device.rounds) round.queries.clear();
  for (std::size_t query = 0; query < groups.size(); ++query) {
    device.of(groups[query]).queries.push_back(query);
  }
  if (events && !device.events_held) device.rounds[kEvents].queries = {kEventsQuery};
  for (Round& round : device.rounds) round.Stop();
}

void Schedule::GoOn(std::size_t index, Instant now) {
  Device& device = devices_[index];
  for (std::size_t i = 0; i < device.rounds.size(); ++i) {
    Round& round = device.rounds[i];
    const Round& before = device.before[i];
    if (round.queries.empty()) continue;
    if (before.queries.empty()) {
      // The queries of this round were in another group before. They have been asked there, so they
      // are not due now.
      if (!round.due || *round.due < now) round.due = now + round.period;
    } else if (before.turn == turn_) {  // the latest request was a query of this round
      round.cursor = std::min(before.cursor - (before.cursor > 0 ? 1 : 0), round.queries.size());
    } else if (before.active()) {
      round.cursor = std::min(before.cursor, round.queries.size());
      if (i == kDaily) round.GoOnAfter(before);
    } else if (round.period == Duration::zero() && round.queries.size() > before.queries.size()) {
      round.due = now;
    }
  }
}

void Schedule::Restart(std::size_t index, Instant now) {
  Device& device = devices_[index];
  device.suspended = false;
  for (Round& round : device.rounds) {
    round = {.queries = round.queries, .period = round.period, .due = now, .turn = round.turn};
    round.Stop();
  }
}

void Schedule::RestartAsPlanned(std::size_t index, Instant now) {
  Device& device = devices_[index];
  Round daily = device.rounds[kDaily];
  daily.GoOnAfter(device.before[kDaily]);
  Restart(index, now);
  if (daily.due && daily.active()) device.rounds[kDaily] = daily;
}

void Schedule::Suspend(std::size_t index) {
  Device& device = devices_[index];
  device.suspended = true;
  device.failing = false;
  for (Round& round : device.rounds) round.Stop();
}

void Schedule::HoldEvents(std::size_t index) {
  Device& device = devices_[index];
  Round& round = device.rounds[kEvents];
  device.events_held = true;
  if (round.active()) round.due = Instant{};
  round.queries.clear();
  round.Stop();
}

void Schedule::ReleaseEvents(std::size_t index, bool events, Brought brought, Instant now) {
  Device& device = devices_[index];
  Round& round = device.rounds[kEvents];
  device.events_held = false;
  round.queries.assign(events ? 1 : 0, kEventsQuery);
  round.Stop();
  if (now >= device.at_once_until) {
    std::size_t queries = 0;  // number of fast queries of the whole line
    for (Device& polled : devices_) {
      if (!polled.suspended) queries += polled.of(config::Group::fast).queries.size();
    }
    device.at_once = std::max(queries, kLeastAtOnce);
    device.at_once_until = now + round.period;
  }
  if (brought == Brought::something_else) {
    round.due = std::max(round.due.value_or(now), now);
  } else if (brought == Brought::news && device.at_once > 0) {
    --device.at_once;
    round.due = now;
  } else {
    round.due = now + round.period;
  }
}

void Schedule::RepeatSoon(std::size_t index, config::Group group, Instant now, Duration most) {
  Round& round = devices_[index].of(group);
  if (std::exchange(round.repeats_soon, true)) return;
  round.Repeat(now + std::min(round.soon, most));
  round.soon = std::min(2 * round.soon, most);
}

void Schedule::Hasten(std::size_t index, Instant now) {
  Device& device = devices_[index];
  const Instant at = std::max(now, device.hasten_from);
  if (at == now) device.hasten_from = now + kHastenAgain;
  for (Round& round : device.rounds) {
    if (!round.queries.empty()) round.Repeat(at);
  }
}

void Schedule::GoFirst(std::size_t index) {
  Device& device = devices_[index];
  device.go_first = 0;
  for (const Round& round : device.rounds) device.go_first += round.queries.size();
}

std::optional<Schedule::Pick> Schedule::Next(Instant now, bool healthy_first) {
  const bool skip_failing = healthy_first && HealthyDue(now);
  Device* best_device = nullptr;
  Round* best = nullptr;
  std::optional<Duration> least;
  for (Device& device : devices_) {
    if (device.suspended || (skip_failing && device.failing)) continue;
    for (Round& round : device.rounds) {
      device.missed += round.StartIfDue(now);
      if (!round.active() || device.hold_until > now) continue;
      least = std::min(least.value_or(device.used), device.used);
      if (best != nullptr) {
        const Duration more = std::max(device.used, used_) - std::max(best_device->used, used_);
        if (more > kAlike || (more >= -kAlike && round.turn >= best->turn)) continue;
      }
      best = &round;
      best_device = &device;
    }
  }
  if (best == nullptr) {
    // No query is due, so there is time for all devices: the line use is counted from zero again.
    for (Device& device : devices_) device.used = {};
    return std::nullopt;
  }
  Pick pick{.device = static_cast<std::size_t>(best_device - devices_.data()),
            .query = best->queries[best->cursor++]};
  pick.last_of_round = !best->active();
  if (pick.query != kEventsQuery) {
    pick.group = static_cast<config::Group>(best - best_device->rounds.data());
  }
  best->turn = ++turn_;
  used_ = std::max(used_, *least);
  best_device->used = std::max(best_device->used, used_);
  if (best_device->go_first > 0) --best_device->go_first;
  return pick;
}

std::optional<Instant> Schedule::DueAt(const Device& device) {
  if (device.suspended) return std::nullopt;
  std::optional<Instant> soonest;
  for (const Round& round : device.rounds) {
    if (round.active()) return device.hold_until;
    if (!round.queries.empty()) soonest = Soonest({soonest, round.due});
  }
  return soonest ? std::optional(std::max(*soonest, device.hold_until)) : std::nullopt;
}

bool Schedule::HealthyDue(Instant now) const {
  return std::ranges::any_of(devices_, [now](const Device& device) {
    return !device.failing && HasCome(DueAt(device), now);
  });
}

bool Schedule::AnotherFails(std::size_t device) const {
  return std::ranges::any_of(devices_, [one = &devices_[device]](const Device& other) {
    return &other != one && other.failing && !other.suspended;
  });
}

std::optional<Instant> Schedule::NextDue() const {
  std::optional<Instant> soonest;
  for (const Device& device : devices_) soonest = Soonest({soonest, DueAt(device)});
  return soonest;
}

std::uint32_t Schedule::Missed(std::size_t index, Instant now) const {
  const Device& device = devices_[index];
  std::uint32_t missed = device.missed;
  if (device.suspended) return missed;
  for (const Round& round : device.rounds) missed += round.Passed(now);
  return missed;
}

void Background::NoteEnd(std::size_t device, Duration took, bool proved) {
  Item& item = At(device);
  item.lost = took == Duration::zero();
  if (item.lost) return;
  Duration& longest = proved ? item.longest_with_proof : item.longest;
  // The effect of a single long exchange fades with each further exchange.
  longest = std::max(took, longest - (longest - took) / 64);
  if (!proved) ++item.known;
}

/// Returns how much time to reserve for the next exchange. A reserve is added, because the next
/// exchange may be longer than all exchanges so far; `room` counts while few exchanges are known.
Duration Background::Item::Room(bool with_proof) const {
  if (with_proof)
    return longest_with_proof == Duration::zero() ? 2 * room : longest_with_proof * 3 / 2;
  if (lost || known < kFew) return room;
  return std::clamp<Duration>(longest * 3 / 2, room / 2, room);
}

std::optional<Instant> Background::MayBegin(std::size_t device) const {
  const Item& item = items_[device];
  if (!item.due || item.awaits_disk || schedule_.suspended(device)) return std::nullopt;
  return std::max({*item.due, item.again, schedule_.held_until(device)});
}

std::optional<std::size_t> Background::Next(Which which, Instant now) const {
  std::optional<std::size_t> best;
  for (std::size_t device = 0; device < items_.size(); ++device) {
    const Item& item = items_[device];
    if (!HasCome(MayBegin(device), now)) continue;
    if (which == Which::that_starves ? item.Starves() > now
                                     : !Fits(item, now >= item.must_prove, now))
      continue;
    if (!best || item.taken < items_[*best].taken) best = device;
  }
  return best;
}

std::optional<Instant> Background::NextAt(Instant now) const {
  std::optional<Instant> soonest;
  for (std::size_t device = 0; device < items_.size(); ++device) {
    const auto begin = MayBegin(device);
    if (!begin) continue;
    const Item& item = items_[device];
    const Instant at = std::max(*begin, now);
    const bool fits = Fits(item, at >= item.must_prove, at);
    soonest = Soonest({soonest, fits ? at : std::max(at, item.Starves())});
  }
  return soonest;
}

std::vector<Turns::Choice> Turns::Order(const Waiting& waiting) const {
  std::vector<Choice> order = {Choice::parked, Choice::probe};
  // Requests of high priority are first, one for each client; then jobs of other kinds.
  if (high_in_row_ < waiting.high_clients) order.push_back(Choice::routed_high);
  if (poll_next_ || !waiting.routed) order.push_back(Choice::poll);
  if (waiting.routed) {
    order.insert(order.end(),
                 {Choice::routed_normal, Choice::poll, Choice::routed_high, Choice::routed_low});
  }
  order.insert(UrgentAllowed(waiting.short_write) ? order.begin() : order.end(), Choice::urgent);
  return order;
}

void Turns::OnTaken(Choice choice, const Waiting& waiting) {
  if (choice == Choice::urgent && UrgentAllowed(waiting.short_write)) ++urgent_in_row_;
  if (choice == Choice::poll) poll_next_ = false;
  if (choice == Choice::routed_normal) poll_next_ = true;
  if (choice < Choice::poll) return;
  const bool high = choice == Choice::routed_high && high_in_row_ < waiting.high_clients;
  high_in_row_ = high ? high_in_row_ + 1 : 0;
}

}  // namespace baudgate::bus
