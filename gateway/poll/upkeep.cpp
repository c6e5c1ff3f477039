// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/upkeep.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace baudgate {
namespace {

constexpr Duration kLongest = 1h;
constexpr Duration kDailyAgain = 5min;

Duration SlowOf(const Device& device) { return std::min<Duration>(device.config->slow, kLongest); }

}  // namespace

Upkeep::Upkeep(Roster& roster, Schedule& schedule, PointStore& store, LateAnswers& late,
               WhoseReply& whose_reply, Chooser& chooser, Ledger& ledger)
    : roster_(roster),
      schedule_(schedule),
      store_(store),
      late_(late),
      whose_reply_(whose_reply),
      chooser_(chooser),
      ledger_(ledger) {
  for (const auto& device : roster_.devices()) {
    const config::Device& config = *device->config;
    schedule_.AddDevice(config.poll, config.slow, config.daily, config.intervals);
    Plan(*device);
    ledger_.ShowOverride(*device);
  }
}

void Upkeep::OnOpened(Instant now) {
  for (const auto& device : roster_.devices()) {
    if (!device->in_use) continue;
    Reconnect(*device, now);
    whose_reply_.OnOpened(*device, now);
    if (!device->health.offline()) schedule_.Restart(device->place, now);
    // The reply to what it was asked before may still come: it waits for that, the others do not.
    if (!late_.IsClear(*device, now)) schedule_.Hold(device->place, late_.LateUntil(*device));
    ledger_.ShowOverride(*device);
  }
}

void Upkeep::OnTask(Member& member, Outcome outcome, const std::string& reason, Instant now) {
  Device* const device = roster_.AsDevice(member);
  const bool was_offline = member.health.offline();
  member.health.OnTask(outcome, now);
  ledger_.OnTask(member, ProvesLife(outcome));
  const bool offline = member.health.offline();
  if (offline && !was_offline) {
    ledger_.OnOffline(member);
    chooser_.DropParked(member);
    chooser_.probes().OnOffline(member);
    late_.OnOffline(member);
    if (device != nullptr) {
      schedule_.Suspend(device->place);
      Reconnect(*device, now);
    }
  } else if (!offline && was_offline && device != nullptr && device->in_use) {
    schedule_.Restart(device->place, now);
  } else if (!offline && device != nullptr && outcome == Outcome::no_reply) {
    DoubtSeldom(*device, now);
  }
  if (offline != was_offline) {
    ledger_.MeasureCycle();
    ShowLine(now);
  }
  const bool degraded = member.health.state() == DeviceState::degraded;
  const std::string_view good = degraded ? "some of its exchanges fail" : "it answers";
  const std::string_view why = outcome == Outcome::ok ? good : Name(outcome);
  ledger_.OnState(member, reason.empty() ? std::string(why) : reason);
}

void Upkeep::OnUnasked(Device& device, Outcome outcome, const std::string& reason,
                       const Finding& finding, Instant now) {
  device.health.OnExchange(outcome);
  ledger_.OnUnasked(device, outcome, reason, finding);
  if (ProvesLife(outcome)) {
    OnTask(device, Outcome::ok, {}, now);
  } else {
    ledger_.OnState(device, reason);
  }
}

void Upkeep::SetInUse(Device& device, bool in_use, bool open, Instant now) {
  device.in_use = in_use;
  chooser_.DropParked(device);
  schedule_.Suspend(device.place);
  if (in_use) {
    Reconnect(device, now);
    if (open && !device.health.offline()) schedule_.Restart(device.place, now);
  }
  ledger_.MeasureCycle();
  ledger_.OnState(device, in_use ? "taken into use" : "taken out of use");
}

void Upkeep::OnEnabled(Device& device, bool open, Instant now) {
  device.conversation->OnEnabled();
  ledger_.OnMemory(device);
  schedule_.Release(device.place);
  if (!device.in_use || !open || device.health.offline()) return;
  chooser_.DropParked(device);
  schedule_.Restart(device.place, now);
}

void Upkeep::OnReplaced(Device& device, Now now) {
  device.conversation->OnReconnect();
  if (device.LearnTimes()) ledger_.ShowTimes(device);
  Plan(device);
  std::vector<Sample> unknown;
  for (std::size_t point = 0; point < device.config->points.size(); ++point) {
    unknown.push_back({static_cast<std::uint32_t>(point), {}, QualityOfDevice(Reason::swapped)});
  }
  store_.Update(device.index, unknown, now, {});
  schedule_.Restart(device.place, now.instant);
  ledger_.OnReplaced(device);
}

void Upkeep::OnRecalled(Device& device) {
  Plan(device);
  ledger_.OnTrouble(device);
}

void Upkeep::OnHeard(Device& device, Instant now) {
  ledger_.OnMemory(device);
  device.LearnTimes();
  if (!ledger_.OnTrouble(device)) return;
  // What was read before is another device's.
  DoubtAll(device, now);
  schedule_.Restart(device.place, now);
}

void Upkeep::DoubtLatest(Instant now) {
  for (const auto& device : roster_.devices()) {
    if (device->conversation->ForgetRefusals()) Plan(*device);
  }
  for (const QueryRef& read : whose_reply_.TakeUnproven()) {
    if (Doubt(read, now)) chooser_.ReadSoon(read);
  }
}

bool Upkeep::Doubt(const QueryRef& read, Instant now) {
  const Device& device = roster_.device(read.device);
  const auto queries = device.conversation->Queries();
  if (!device.in_use || read.query >= queries.size()) return false;
  store_.Doubt(device.index, queries[read.query].points, now);
  return true;
}

/// It has been away: if another one is there now, what is read seldom is not good any more.
void Upkeep::DoubtSeldom(Device& device, Instant now) {
  std::vector<std::size_t> points;
  for (std::size_t point = 0; point < device.config->points.size(); ++point) {
    if (IsSeldom(device.config->points[point].group)) points.push_back(point);
  }
  if (points.empty()) return;
  store_.Doubt(device.index, points, now);
  schedule_.Repeat(device.place, config::Group::once, now);
  schedule_.Repeat(device.place, config::Group::daily, now + SlowOf(device));
}

void Upkeep::Repeat(const Device& device, config::Group group, Instant now) {
  const Duration least = group == config::Group::daily ? kDailyAgain : Duration::zero();
  schedule_.Repeat(device.place, group, now + std::max(SlowOf(device), least));
}

/// Nothing that was learned of the device holds any more: it may be another one. What it has said
/// is not good again before it says it again.
void Upkeep::Reconnect(Device& device, Instant now) {
  device.conversation->OnReconnect();
  device.LearnTimes();
  whose_reply_.OnReconnect(device);
  Plan(device);
  DoubtAll(device, now);
}

void Upkeep::DoubtAll(const Device& device, Instant now) {
  std::vector<std::size_t> points(device.config->points.size());
  std::iota(points.begin(), points.end(), 0U);
  store_.Doubt(device.index, points, now);
}

void Upkeep::Plan(Device& device) {
  std::vector<config::Group> groups;
  for (const Query& query : device.conversation->Queries()) groups.push_back(query.group);
  schedule_.SetQueries(device.place, std::move(groups), device.conversation->HasEvents());
  chooser_.DropParked(device);  // its query may be another one now
  ledger_.OnPlan(device);
}

void Upkeep::PlanBackground(const Device& device) {
  chooser_.PlanBackground(device);
  chooser_.background().SetProof(device.place, whose_reply_.ProofRenews(device),
                                 whose_reply_.ProofEnds(device));
}

void Upkeep::HoldBack(const Member& member) {
  const Instant until = late_.LateUntil(member);
  for (const auto& device : roster_.devices()) {
    if (device->IsSame(member)) schedule_.Hold(device->place, until);
  }
}

}  // namespace baudgate
