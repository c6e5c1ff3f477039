// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/probes.h"

#include <algorithm>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

namespace {

/// If the last probe of a device is older than this, its next probe does not wait until the line
/// happens to be silent for kRest: the line keeps this silence before the probe.
constexpr Duration kLongestWait = 2s;

/// Returns the period of which `time` is the part `share`. Example: 1 s is 0.02 of 50 s.
Duration TimeToEarn(Duration time, double share) {
  return Duration(static_cast<std::int64_t>(static_cast<double>(time.count()) / share));
}

}  // namespace

std::optional<Instant> ProbeBudget::NextProbe(Instant now, std::optional<Instant> next_due,
                                              Instant idle_since, Duration worst_cost) const {
  const Instant earliest = std::max(now, pause_until_);
  const bool fits_in_idle_time = !next_due || earliest + worst_cost <= *next_due;
  if (fits_in_idle_time) return earliest;
  if (idle_since == now && earliest == now && share_free_at_ <= now) return now;
  return std::nullopt;
}

void ProbeBudget::OnProbe(Instant from, Instant to, Duration waited) {
  pause_until_ = to + kPause;
  if (waited > Duration::zero()) share_free_at_ = from + TimeToEarn(waited, share_);
}

Duration ProbeBudget::Interval(Duration cost, Duration waited, double share) {
  return std::max(cost + kPause, TimeToEarn(waited, share));
}

void Probes::OnOpened() {
  first_looks_ = ProbeBudget(kFirstShare);
  looks_ = ProbeBudget();
  writes_ = ProbeBudget(kWriteShare);
}

bool Probes::HasFirstLook(const Member& member, Instant now) const {
  const Entry& entry = entries_[member];
  return entry.first_looks > 0 && now < entry.first_until;
}

Instant Probes::ReadyAt(const Member& member) const {
  return std::max(late_.LateUntil(member), entries_[member].ask_again.value_or(Instant{}));
}

ProbeBudget& Probes::BudgetOf(Kind kind) {
  if (kind == Kind::short_write) return writes_;
  return kind == Kind::first_look ? first_looks_ : looks_;
}

Member* Probes::Next(const Facts& facts) const {
  const auto& everyone = roster_.everyone();
  Member* next = nullptr;
  for (std::size_t i = 0; i < everyone.size(); ++i) {
    Member* member = everyone[(turn_ + i) % everyone.size()];
    const bool can = member->health.absent() && ReadyAt(*member) <= facts.now;
    if (!can || !facts.is_looked_for(*member)) continue;
    if (HasFirstLook(*member, facts.now)) return member;
    if (next == nullptr) next = member;
  }
  return next;
}

std::optional<Probes::Look> Probes::LookAt(const Member& member, const Facts& facts) const {
  const Duration worst = late_.WorstCase(member);
  const bool first = HasFirstLook(member, facts.now);
  const ProbeBudget& budget = first ? first_looks_ : looks_;
  const Kind kind = first ? Kind::first_look : Kind::look;
  const auto next = [&](Instant from, Duration cost) {
    return budget.NextProbe(from, facts.next_wanted, facts.idle_since, cost);
  };
  const bool rest = !first && member.device != nullptr && !member.protocol->tcp &&
                    entries_[member].hasty_looks >= kHastyLooks;
  if (rest) {
    // Even if no poll is due, writes and background reads may leave no silence of kRest. So after
    // kLongestWait the line keeps the silence itself (rested_look).
    const Entry& entry = entries_[member];
    const bool long_ago = entry.probed_at && facts.now - *entry.probed_at >= kLongestWait;
    const auto rested = next(std::max(facts.now, facts.idle_since + kRest), worst);
    if (rested && (!long_ago || *rested <= facts.now)) return Look{*rested, kind};
    const auto waits = next(facts.now, kRest + worst);
    if (waits) return Look{*waits, Kind::rested_look};
  }
  if (const auto when = next(facts.now, worst)) return Look{*when, kind};
  // A client waits for this member, and may have given up by the end of the next exchange. So the
  // probe does not wait for an exchange: it may delay other devices as soon as the share of
  // `budget` allows.
  if (facts.client_waits(member)) return Look{std::max(facts.now, budget.earned_at()), kind};
  return std::nullopt;
}

std::optional<Instant> Probes::NextAt(const Facts& facts) const {
  const Member* next = Next(facts);
  if (next == nullptr) {
    // Every offline member has to wait. The earliest time at which one of them can be probed
    // counts.
    std::optional<Instant> soonest;
    for (const Member* member : roster_.everyone()) {
      if (!member->health.absent() || !facts.is_looked_for(*member)) continue;
      const Instant ready = ReadyAt(*member);
      if (ready > facts.now) soonest = Soonest({soonest, ready});
    }
    return soonest;
  }
  if (const auto look = LookAt(*next, facts)) return look->at;
  // From this time on no requests of clients are expected, so a probe may fit into idle time.
  return facts.clients_gone && *facts.clients_gone > facts.now ? facts.clients_gone : std::nullopt;
}

Instant Probes::NextWriteAt(const Member& member, const Facts& facts) const {
  const auto free =
      writes_.NextProbe(facts.now, facts.next_wanted, facts.idle_since, late_.WorstCase(member));
  return free.value_or(std::max(facts.now, writes_.earned_at()));
}

Probes::Kind Probes::OnTaken(const Member& member, const Facts& facts) {
  const auto look = LookAt(member, facts);
  const Kind kind = look ? look->kind : Kind::look;
  turn_ = member.place + 1;
  Entry& entry = entries_[member];
  if (kind == Kind::first_look) --entry.first_looks;
  const bool rested = kind == Kind::rested_look || facts.now - facts.idle_since >= kRest;
  entry.hasty_looks = rested ? 0 : entry.hasty_looks + 1;
  return kind;
}

std::optional<Instant> Probes::began() const {
  return ended_.member == nullptr ? std::nullopt : std::optional(ended_.began);
}

void Probes::OnIdle(Duration waited, Instant now) {
  const Ended ended = std::exchange(ended_, {});
  Entry& entry = entries_[*ended.member];
  BudgetOf(ended.kind).OnProbe(ended.began, now, waited);
  entry.waited = ended.kind == Kind::rested_look ? std::max<Duration>(waited - kRest, {}) : waited;
  if (entry.probed_at) entry.gap = ended.began - *entry.probed_at;
  entry.probed_at = ended.began;
}

std::optional<Duration> Probes::NoticeBound(Instant now) const {
  Duration turn{};
  Duration period{};
  Duration seen{};
  Duration first{};
  Instant first_until = now;
  std::optional<Duration> known;  // the longest delay by a probe of any member
  for (const Member* member : roster_.everyone()) {
    if (member->in_use && member->health.absent())
      known = std::max(known, entries_[*member].waited);
  }
  for (const Member* member : roster_.everyone()) {
    if (!member->in_use || CannotProbe(*member)) continue;
    if (member->health.absent()) {
      const Entry& entry = entries_[*member];
      const Duration worst = late_.WorstCase(*member);
      const Duration waited = entry.waited.value_or(known.value_or(worst));
      const bool rests = member->device != nullptr && !member->protocol->tcp;
      const Duration rest = rests ? kRest : Duration();
      turn += ProbeBudget::Interval(worst + rest, waited > Duration() ? waited + rest : waited);
      seen = std::max(seen, entry.gap + worst);
      if (!HasFirstLook(*member, now)) continue;
      first += entry.first_looks *
               ProbeBudget::Interval(worst, entry.waited.value_or(worst), kFirstShare);
      first_until = std::max(first_until, entry.first_until);
    } else if (const Device* device = member->device) {
      period = std::max(period, device->config->poll);
    }
  }
  if (turn == Duration::zero()) return std::nullopt;
  const Duration blocked = std::max<Duration>(looks_.earned_at() - now, {});
  return std::max(std::min(first, first_until - now) + blocked + turn + period, seen);
}

}  // namespace baudgate::bus
