// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/schedule.h"

#include <algorithm>

#include "gateway/base/time.h"

namespace baudgate::bus {

namespace {

/// Devices with similar line use take turns: one that is asked again at once might still be sending
/// the rest of its previous reply.
constexpr Duration kAlike = 200ms;

}  // namespace

std::size_t Schedule::AddDevice(Duration fast_period, Duration slow_period, Duration daily_period,
                                const std::vector<Duration>& intervals) {
  Device device;
  device.rounds.resize(NumberOf(config::Group::again) + 1);
  device.rounds[NumberOf(config::Group::again)].period = config::kAgainPeriod;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    device.rounds[NumberOf(config::OwnGroup(i))].period = intervals[i];
  }
  device.rounds[static_cast<std::size_t>(config::Group::fast)].period = fast_period;
  device.rounds[static_cast<std::size_t>(config::Group::slow)].period = slow_period;
  device.rounds[static_cast<std::size_t>(config::Group::daily)].period = daily_period;
  device.rounds[kEvents].period = fast_period;
  devices_.push_back(std::move(device));
  return devices_.size() - 1;
}

void Schedule::SetQueries(std::size_t index, std::vector<config::Group> groups, bool events) {
  Device& device = devices_[index];
  Round& once = device.rounds[static_cast<std::size_t>(config::Group::once)];
  Round& daily = device.rounds[static_cast<std::size_t>(config::Group::daily)];
  for (Round& round : device.rounds) {
    round.Remember(round.turn == turn_ && turn_ > 0);
  }
  if (once.active()) once.due = Instant{};
  const std::size_t asked_daily = daily.cursor;
  const std::size_t left = daily.queries.size() - asked_daily;
  for (Round& round : device.rounds) round.queries.clear();
  for (std::size_t query = 0; query < groups.size(); ++query) {
    device.rounds[NumberOf(groups[query])].queries.push_back(query);
  }
  if (events) device.rounds[kEvents].queries.push_back(kEventsQuery);
  for (Round& round : device.rounds) round.Stop();
  // Example: two of four queries were asked, and one of these two is gone: one of three was asked,
  // two are left. With more than before it is not known which are new.
  const std::size_t now_daily = daily.queries.size();
  daily.cursor = now_daily > asked_daily + left ? 0 : now_daily - std::min(left, now_daily);
}

void Schedule::HoldEvents(std::size_t index) { devices_[index].rounds[kEvents].Block(); }

/// Queries of all devices that are polled; small lines have room for some more.
int Schedule::QueriesOfARound() const {
  constexpr std::size_t kLeast = 4;
  std::size_t queries = 0;
  for (const Device& device : devices_) {
    if (device.suspended) continue;
    queries += device.rounds[static_cast<std::size_t>(config::Group::fast)].queries.size();
  }
  return static_cast<int>(std::max(queries, kLeast));
}

void Schedule::ReleaseEvents(std::size_t index, bool events, Brought brought, Instant now) {
  Device& device = devices_[index];
  Round& round = device.rounds[kEvents];
  round.queries.assign(events ? 1 : 0, kEventsQuery);
  round.Stop();
  round.blocked = false;
  if (now >= device.at_once_until) {
    device.at_once = QueriesOfARound();
    device.at_once_until = now + round.period;
  }
  round.due = now + round.period;
  if (brought == Brought::something_else) round.due = std::max(round.planned.value_or(now), now);
  if (brought != Brought::news || device.at_once == 0) return;
  --device.at_once;
  round.due = now;
}

void Schedule::Restart(std::size_t index, Instant now) {
  Device& device = devices_[index];
  device.suspended = false;
  for (Round& round : device.rounds) round.Restart(now);
}

void Schedule::RestartAsPlanned(std::size_t index, Instant now) {
  Round& daily = devices_[index].rounds[static_cast<std::size_t>(config::Group::daily)];
  const Round before = daily;
  Restart(index, now);
  if (before.due && before.active()) daily = before;
}

void Schedule::GoOn(std::size_t index, Instant now) {
  Device& device = devices_[index];
  for (Round& round : device.rounds) {
    if (round.blocked || round.queries.empty()) continue;
    const Round::Before& before = round.before;
    round.due = before.due;
    if (before.queries == 0) {
      // What has come into it was asked a moment ago.
      round.Stop();
      if (!round.due || *round.due < now) round.due = now + round.period;
    } else if (before.asked || (before.active && &round != &device.rounds[kDaily])) {
      round.cursor = std::min(before.next, round.queries.size());
    } else if (!before.active) {
      round.Stop();
      const bool grew = round.queries.size() > before.queries;
      if (round.period == Duration::zero() && grew) round.due = now;
    }
  }
}

void Schedule::Repeat(std::size_t index, config::Group group, Instant at) {
  devices_[index].rounds[NumberOf(group)].Repeat(at);
}

void Schedule::RepeatSoon(std::size_t index, config::Group group, Instant now, Duration most) {
  devices_[index].rounds[NumberOf(group)].RepeatSoon(now, most);
}

void Schedule::Hasten(std::size_t index, Instant now) {
  Device& device = devices_[index];
  const Instant at = std::max(now, device.hasten_from);
  if (at == now) device.hasten_from = now + kHastenAgain;
  for (Round& round : device.rounds) {
    if (!round.blocked && !round.queries.empty()) round.Repeat(at);
  }
}

void Schedule::Suspend(std::size_t index) {
  Device& device = devices_[index];
  device.suspended = true;
  device.failing = false;
  for (Round& round : device.rounds) round.Stop();
}

void Schedule::Hold(std::size_t index, Instant until) {
  devices_[index].hold_until = std::max(devices_[index].hold_until, until);
}

void Schedule::GoFirst(std::size_t index) {
  Device& device = devices_[index];
  device.go_first = 0;
  for (const Round& round : device.rounds) device.go_first += round.queries.size();
}

bool Schedule::GoesFirst(std::size_t index, Instant now) const {
  return devices_[index].go_first > 0 && IsDue(devices_[index], now);
}

std::uint32_t Schedule::Missed(std::size_t index, Instant now) const {
  const Device& device = devices_[index];
  std::uint32_t missed = device.missed;
  if (device.suspended) return missed;
  for (const Round& round : device.rounds) {
    if (!round.active() && !round.queries.empty()) missed += round.Passed(now);
  }
  return missed;
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
      const auto is_before = [&] {
        const Duration more = std::max(device.used, used_) - std::max(best_device->used, used_);
        return more < -kAlike || (more <= kAlike && round.turn < best->turn);
      };
      if (best == nullptr || is_before()) {
        best = &round;
        best_device = &device;
      }
    }
  }
  if (best == nullptr) {
    // If there is time for all, no device has a debt to others.
    for (Device& device : devices_) device.used = {};
    used_ = {};
    return std::nullopt;
  }
  Pick pick;
  pick.device = static_cast<std::size_t>(best_device - devices_.data());
  const auto round = static_cast<std::size_t>(best - best_device->rounds.data());
  if (round != kEvents) pick.group = GroupOf(round);
  pick.query = best->queries[best->cursor++];
  pick.last_of_round = !best->active();
  best->turn = ++turn_;
  used_ = std::max(used_, *least);
  best_device->used = std::max(best_device->used, used_);
  if (best_device->go_first > 0) --best_device->go_first;
  return pick;
}

std::optional<Instant> Schedule::DueAt(const Device& device, const Round& round) {
  if (device.suspended) return std::nullopt;
  if (round.active()) return device.hold_until;
  if (!round.due || round.queries.empty()) return std::nullopt;
  return std::max(*round.due, device.hold_until);
}

bool Schedule::IsDue(const Device& device, Instant now) {
  return std::ranges::any_of(device.rounds, [&](const Round& round) {
    const auto due = DueAt(device, round);
    return due && *due <= now;
  });
}

bool Schedule::HealthyDue(Instant now) const {
  return std::ranges::any_of(
      devices_, [now](const Device& device) { return !device.failing && IsDue(device, now); });
}

bool Schedule::AnotherFails(std::size_t device) const {
  return std::ranges::any_of(devices_, [one = &devices_[device]](const Device& other) {
    return &other != one && other.failing && !other.suspended;
  });
}

std::optional<Instant> Schedule::NextDue() const {
  std::optional<Instant> soonest;
  for (const Device& device : devices_) {
    for (const Round& round : device.rounds) {
      soonest = Soonest({soonest, DueAt(device, round)});
    }
  }
  return soonest;
}

Background::Item& Background::At(std::size_t device) {
  if (items_.size() <= device) items_.resize(device + 1);
  return items_[device];
}

void Background::Set(std::size_t device, std::optional<Instant> due, Duration room) {
  Item& item = At(device);
  item.due = due;
  item.room = room;
}

void Background::OnTaken(std::size_t device, Instant now) {
  items_[device].taken = now;
  items_[device].again = {};
  items_[device].turn = ++turn_;
}

void Background::SetProof(std::size_t device, Instant may, Instant must) {
  Item& item = At(device);
  item.may_prove = may;
  item.must_prove = must;
}

void Background::Longest::Learn(Duration its) {
  constexpr int kFades = 64;
  took = std::max(its, took - (took - its) / kFades);
  ++known;
}

void Background::NoteEnd(std::size_t device, Duration took, bool proved) {
  Item& item = At(device);
  item.lost = took == Duration::zero();
  if (!item.lost) (proved ? item.proved : item.plain).Learn(took);
}

std::optional<Instant> Background::MayBegin(std::size_t device) const {
  const Item& item = items_[device];
  if (!item.due || item.awaits_disk || schedule_.suspended(device)) return std::nullopt;
  return std::max({*item.due, item.again, schedule_.held_until(device)});
}

Instant Background::Starves(const Item& item) const {
  return std::max(*item.due, item.taken) + kLongest;
}

/// The next exchange may be longer than all so far; few say little.
Duration Background::RoomOf(const Item& item) {
  if (item.lost || item.plain.known < kFew) return item.room;
  return std::clamp<Duration>(item.plain.took * 3 / 2, item.room / 2, item.room);
}

Duration Background::RoomToProve(const Item& item) {
  return item.proved.known == 0 ? 2 * item.room : item.proved.took * 3 / 2;
}

bool Background::IsIdleFor(Duration room, Instant at) const {
  const auto poll = schedule_.NextDue();
  return !poll || *poll - at >= room;
}

bool Background::Fits(const Item& item, Instant at) const {
  return IsIdleFor(at >= item.must_prove ? RoomToProve(item) : RoomOf(item), at);
}

bool Background::HasRoom(std::size_t device, Instant now) const {
  return device < items_.size() && IsIdleFor(RoomOf(items_[device]), now);
}

bool Background::MayProve(std::size_t device, Instant now) const {
  const Item& item = items_[device];
  return now >= item.may_prove && IsIdleFor(RoomToProve(item), now);
}

std::optional<std::size_t> Background::Next(Which which, Instant now) const {
  std::optional<std::size_t> best;
  for (std::size_t device = 0; device < items_.size(); ++device) {
    const Item& item = items_[device];
    const auto begin = MayBegin(device);
    if (!begin || *begin > now) continue;
    if (which == Which::that_starves ? Starves(item) > now : !Fits(item, now)) continue;
    if (!best || item.turn < items_[*best].turn) best = device;
  }
  return best;
}

std::optional<Instant> Background::NextAt(Instant now) const {
  std::optional<Instant> soonest;
  for (std::size_t device = 0; device < items_.size(); ++device) {
    const auto begin = MayBegin(device);
    if (!begin) continue;
    const Instant at = std::max(*begin, now);
    const Instant when = Fits(items_[device], at) ? at : std::max(at, Starves(items_[device]));
    soonest = Soonest({soonest, when});
  }
  return soonest;
}

}  // namespace baudgate::bus
