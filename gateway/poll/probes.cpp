// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/probes.h"

#include <algorithm>
#include <utility>

namespace baudgate {

void Probes::OnOpened() {
  looks_ = ProbeBudget();
  writes_ = ProbeBudget(kWriteShare);
}

Member* Probes::Next(const Facts& facts) const {
  const auto& everyone = roster_.everyone();
  for (std::size_t i = 0; i < everyone.size(); ++i) {
    Member* member = everyone[(turn_ + i) % everyone.size()];
    const bool can = member->health.offline() && late_.IsClear(*member, facts.now);
    if (can && facts.is_looked_for(*member)) return member;
  }
  return nullptr;
}

std::optional<Instant> Probes::NextAt(const Facts& facts) const {
  const Member* next = Next(facts);
  if (next == nullptr) {
    // When the first may be asked whose late answer is still waited for.
    std::optional<Instant> soonest;
    for (const Member* member : roster_.everyone()) {
      if (!member->health.offline() || !facts.is_looked_for(*member)) continue;
      const Instant clear = late_.LateUntil(*member);
      if (clear > facts.now) soonest = std::min(soonest.value_or(clear), clear);
    }
    return soonest;
  }
  const auto when =
      looks_.NextProbe(facts.now, facts.next_wanted, facts.idle_since, late_.WorstCase(*next));
  if (when) return when;
  // A client that waits for its answer is there now, but perhaps not when the line is idle again.
  if (facts.client_waits(*next)) return std::max(facts.now, looks_.earned_at());
  // When the clients have stayed away for this long, the line counts as free.
  return facts.clients_gone && *facts.clients_gone > facts.now ? facts.clients_gone : std::nullopt;
}

Instant Probes::NextWriteAt(const Member& member, const Facts& facts) const {
  const auto free =
      writes_.NextProbe(facts.now, facts.next_wanted, facts.idle_since, late_.WorstCase(member));
  return free.value_or(std::max(facts.now, writes_.earned_at()));
}

std::optional<Instant> Probes::began() const {
  return ended_.member == nullptr ? std::nullopt : std::optional(ended_.began);
}

void Probes::OnIdle(Duration waited, Instant now) {
  const Ended ended = std::exchange(ended_, {});
  State& state = states_[*ended.member];
  ProbeBudget& budget = ended.kind == Kind::look ? looks_ : writes_;
  budget.OnProbe(ended.began, now, waited);
  state.waited = waited;
  if (state.probed_at) state.gap = ended.began - *state.probed_at;
  state.probed_at = ended.began;
}

Duration Probes::NoticeBound(Instant now) const {
  Duration turn{};
  Duration period{};
  Duration seen{};
  std::optional<Duration> known;  // the longest wait for any of them
  for (const Member* member : roster_.everyone()) {
    if (member->in_use && member->health.offline())
      known = std::max(known, states_[*member].waited);
  }
  for (const Member* member : roster_.everyone()) {
    if (!member->in_use) continue;
    if (member->health.offline()) {
      const State& state = states_[*member];
      const Duration worst = late_.WorstCase(*member);
      turn += ProbeBudget::Interval(worst, state.waited.value_or(known.value_or(worst)));
      seen = std::max(seen, state.gap + worst);
    } else if (const Device* device = member->device) {
      period = std::max(period, device->config->poll);
    }
  }
  if (turn == Duration::zero()) return turn;
  const Duration blocked = std::max<Duration>(looks_.earned_at() - now, {});
  return std::max(blocked + turn + period, seen);
}

}  // namespace baudgate
