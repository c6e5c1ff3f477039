// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/device_tracker.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "gateway/base/text.h"

namespace baudgate::bus {

namespace {

constexpr Duration kLongest = 1h;
constexpr Duration kDailyAgain = 5min;

bool IsSameDevice(const Device& one, const Device& other) {
  const auto canonical = one.protocol->canonical_address;
  const auto address = canonical(one.config->address);
  const auto its = canonical(other.config->address);
  return address && its && *address == *its;
}

/// True if one of the written points has the same address in the device as the point `shown`, so
/// that the write may change the value of `shown`.
bool SharesPlace(std::span<const config::Point> points, std::span<const PointWrite> writes,
                 const config::Point& shown) {
  return std::ranges::any_of(writes, [&](const PointWrite& write) {
    const config::Point& written = points[write.point];
    return (!shown.read.empty() && (shown.read == written.read || shown.read == written.write)) ||
           (!shown.write.empty() && (shown.write == written.write || shown.write == written.read));
  });
}

Duration SlowOf(const Device& device) { return std::min<Duration>(device.config->slow, kLongest); }

}  // namespace

DeviceTracker::DeviceTracker(Roster& roster, PointStore& store, OwedReplies& owed, Agenda& agenda,
                             Accounts& accounts)
    : roster_(roster), store_(store), owed_(owed), agenda_(agenda), accounts_(accounts) {
  for (const auto& device : roster_.devices()) {
    const config::Device& config = *device->config;
    agenda_.schedule.AddDevice(config.poll, config.slow, config.daily, config.intervals);
    Plan(*device);
    accounts_.states.ShowOverride(*device);
  }
}

void DeviceTracker::OnOpened(Instant now) {
  accounts_.OnOpened();
  agenda_.probes.OnOpened();
  for (const auto& device : roster_.devices()) {
    if (!device->in_use) continue;
    Reconnect(*device, now);
    owed_.whose.OnOpened(*device, now);
    if (!device->health.absent()) agenda_.schedule.Restart(device->place, now);
    // A reply to an earlier request may still come, so polls of this device wait. Other devices
    // are polled at once.
    if (!owed_.late_replies.IsClear(*device, now))
      agenda_.schedule.Hold(device->place, owed_.late_replies.LateUntil(*device));
    accounts_.states.ShowOverride(*device);
  }
}

void DeviceTracker::OnClosed(Instant now) {
  for (const auto& device : roster_.devices()) {
    agenda_.parked.Drop(*device);
    agenda_.schedule.Suspend(device->place);
  }
  agenda_.probes.OnClosed();
  ShowLine(now);
}

void DeviceTracker::OnUnansweredTelegram(Instant now) {
  for (const auto& device : roster_.devices()) {
    owed_.whose.OnOpened(*device, now);
    owed_.late_replies.OnUnknownRequest(*device, now);
  }
}

DeviceTracker::Touched DeviceTracker::TouchedBy(View request, const Device* by,
                                                std::span<const PointWrite> writes,
                                                const Device& device) {
  if (device.protocol->changes) return device.protocol->changes(request, *device.config);
  if (by == nullptr) return std::nullopt;
  std::vector<std::size_t> touched;
  if (!IsSameDevice(*by, device)) return touched;
  const auto& points = device.config->points;
  for (std::size_t point = 0; point < points.size(); ++point) {
    if (SharesPlace(by->config->points, writes, points[point])) touched.push_back(point);
  }
  return touched;
}

void DeviceTracker::OnWritten(const protocols::Protocol& protocol, View request, const Device* by,
                              std::span<const PointWrite> writes, bool answered, Instant now) {
  for (const auto& device : roster_.devices()) {
    if (device->protocol != &protocol || !device->in_use) continue;
    if (const Touched touched = TouchedBy(request, by, writes, *device)) {
      Outdate(*device, *touched, now);
    } else if (answered) {
      agenda_.schedule.Hasten(device->place, now);
    } else {
      for (const config::Group group : {config::Group::once, config::Group::daily}) {
        agenda_.schedule.Repeat(device->place, group, now);
      }
    }
  }
}

void DeviceTracker::OnTelegram(const protocols::Protocol& protocol, View telegram, Instant now) {
  for (const auto& device : roster_.devices()) {
    if (device->protocol != &protocol || !device->in_use) continue;
    if (const Touched touched = TouchedBy(telegram, nullptr, {}, *device)) {
      Outdate(*device, *touched, now);
    } else {
      DoubtAll(*device, now);
      agenda_.schedule.Hasten(device->place, now);
    }
  }
}

/// Makes the points uncertain and reads them again. The points of an offline device are not read
/// now: all its polls are due when it returns.
void DeviceTracker::Outdate(const Device& device, const std::vector<std::size_t>& points,
                            Instant now) {
  if (points.empty()) return;
  OnPointsWritten(device, points, now);
  if (!device.health.absent()) ReadBack(device, points);
}

void DeviceTracker::OnExchange(EndedExchange& ended, Instant now) {
  Member& member = *ended.member;
  const ExchangeEnd& end = ended.end;
  if (!ended.broadcast) member.health.OnExchange(end.outcome);
  owed_.OnEnded(ended.asked, end, ended.broadcast, now);
  ended.patience = owed_.late_replies.PatienceFor(member);
  ended.lags = owed_.whose.Lags(member);
  if (ended.answered() && !owed_.late_replies.IsClear(member, now)) HoldBack(member);
  if (!ended.cut_off() && !ended.broadcast) Charge(ended, now);
  if (ended.verdict.shifted) DoubtLatest(now);
  if (ended.answered() && ended.routed) agenda_.routes.OnAnswered(now);
}

/// Counts the line time of a device's first failed exchange as time of failing devices (Turns).
/// Chooser::OnTime counts later failures, because the device counts as failing from here on.
void DeviceTracker::Charge(const EndedExchange& ended, Instant now) {
  const Member& member = *ended.member;
  if (member.device == nullptr) return;
  const bool in_vain = !ended.answered() || member.health.refuses();
  if (in_vain && !agenda_.schedule.failing(member.place)) agenda_.turns.Charge(now - ended.began);
  agenda_.schedule.SetFailing(member.place, in_vain);
  if (ended.polls) agenda_.schedule.OnUsed(member.place, now - ended.began);
}

void DeviceTracker::OnTask(Member& member, Outcome outcome, const std::string& reason,
                           Instant now) {
  Device* const device = member.device;
  const bool was_offline = member.health.absent();
  member.health.OnTask(outcome, now);
  accounts_.devices.OnTask(member, ProvesLife(outcome));
  const bool offline = member.health.absent();
  if (offline && !was_offline) {
    accounts_.devices.OnOffline(member);
    agenda_.probes.OnOffline(member, now);
    owed_.late_replies.OnOffline(member);
    if (device != nullptr) {
      agenda_.schedule.Suspend(device->place);
      Reconnect(*device, now);
    }
  } else if (!offline && was_offline && device != nullptr && device->in_use) {
    agenda_.schedule.Restart(device->place, now);
  } else if (!offline && device != nullptr && outcome == Outcome::no_reply) {
    DoubtSeldom(*device, now);
  }
  if (offline != was_offline) {
    accounts_.rounds.Measure(now);
    ShowLine(now);
  }
  const bool degraded = member.health.state() == DeviceState::degraded;
  const std::string good = degraded ? "some of its exchanges fail" : "it answers";
  const std::string why = outcome == Outcome::ok ? good : InWords(Name(outcome));
  accounts_.states.OnState(member, reason.empty() ? why : reason);
}

void DeviceTracker::CountLate(const Member& member, Duration lateness, Instant now) {
  if (member.device != nullptr) member.device->heard.OnLate(now);
  agenda_.probes.OnLate(member);
  accounts_.line.OnLate();
  accounts_.devices.OnLate(member, lateness, owed_.late_replies.PatienceFor(member));
  ShowLine(now);
}

void DeviceTracker::OnUnasked(Device& device, Outcome outcome, const std::string& reason,
                              Instant now) {
  device.health.OnExchange(outcome);
  accounts_.line.OnUnasked(outcome);
  accounts_.devices.OnUnasked(device, outcome, reason);
  if (ProvesLife(outcome)) {
    OnTask(device, Outcome::ok, {}, now);
  } else {
    accounts_.states.OnState(device, reason);
  }
}

void DeviceTracker::SetInUse(Device& device, bool in_use, bool open, Instant now) {
  device.in_use = in_use;
  agenda_.parked.Drop(device);
  agenda_.schedule.Suspend(device.place);
  if (in_use) {
    Reconnect(device, now);
    if (open && !device.health.absent()) agenda_.schedule.Restart(device.place, now);
  }
  accounts_.rounds.Measure(now);
  accounts_.states.OnState(device, in_use ? "taken into use" : "taken out of use");
}

void DeviceTracker::NoteUse(const Device& device, const std::string& by, WallTime now) {
  store_.UpdateStatus(device.index, [&](DeviceStatus& status) {
    status.disabled_by = device.in_use ? std::string() : by;
    status.disabled_since = now;
  });
}

void DeviceTracker::OnEnabled(Device& device, bool open, Instant now) {
  device.conversation->OnEnabled();
  accounts_.states.OnMemory(device);
  agenda_.schedule.Release(device.place);
  if (!device.in_use || !open || device.health.absent()) return;
  agenda_.parked.Drop(device);
  agenda_.schedule.Restart(device.place, now);
}

void DeviceTracker::OnReplaced(Device& device, Now now) {
  device.conversation->OnReconnect();
  if (device.LearnTimes()) accounts_.states.ShowTimes(device);
  Plan(device);
  // Points that no query reads, such as commands, get bad_waiting: no reading would ever replace
  // the quality of a replaced device.
  std::vector<Quality> qualities(device.config->points.size(), Quality::bad_waiting);
  for (const protocols::Query& query : device.planned_queries) {
    for (const std::size_t point : query.points) {
      qualities[point] = QualityOfDevice(Reason::swapped);
    }
  }
  std::vector<Sample> unknown;
  for (std::size_t point = 0; point < qualities.size(); ++point) {
    unknown.push_back({static_cast<std::uint32_t>(point), {}, qualities[point]});
  }
  store_.Update(device.index, unknown, now, {});
  if (device.in_use) agenda_.schedule.Restart(device.place, now.instant);
  accounts_.states.OnReplaced(device);
}

void DeviceTracker::OnRecalled(Device& device) {
  Plan(device);
  accounts_.states.OnTrouble(device);
}

void DeviceTracker::OnHeard(Device& device, Instant now) {
  accounts_.states.OnMemory(device);
  device.LearnTimes();
  if (!accounts_.states.OnTrouble(device)) return;
  // A trouble of the device, such as a wrong type, has ended. Values read during it are doubtful.
  DoubtAll(device, now);
  if (device.in_use) agenda_.schedule.Restart(device.place, now);
}

LateReplies::StrayEffects DeviceTracker::ApplyStray(const StrayBytes& stray, Instant now) {
  LateReplies::StrayEffects effects = owed_.late_replies.OnStray(stray, now);
  accounts_.line.CountStray(stray.count, effects.counts);
  if (effects.late_member != nullptr) CountLate(*effects.late_member, effects.lateness, now);
  return effects;
}

void DeviceTracker::OnSecondReply(Instant now) {
  const Member* const last = owed_.late_replies.last();
  if (last == nullptr) return;
  accounts_.devices.OnSecondReply(*last);
  owed_.whose.OnSecondReply(*last);
  owed_.late_replies.OnSecondReply(*last);
  DoubtLatest(now);
}

/// Makes the values of the latest replies uncertain and reads them again, because one of these
/// replies belonged to another request, and it is unknown which.
void DeviceTracker::DoubtLatest(Instant now) {
  for (const auto& device : roster_.devices()) {
    if (!device->conversation->ForgetRefusals()) continue;
    GoOnWithPlan(*device, now);
  }
  for (const LatestReadings::Points& read : owed_.readings.TakeAll()) {
    const Device& device = roster_.device(read.device);
    if (!device.in_use) continue;
    Doubt(device, read.points, now);
    ReadBack(device, read.points);
  }
}

Value DeviceTracker::KnownValue(const Device& device, std::size_t point, Instant now) const {
  Value value;
  store_.Read(device.index,
              [&](const DeviceRecord& record) { value = bus::KnownValue(record, point, now); });
  return value;
}

void DeviceTracker::OnPointsWritten(const Device& device, const std::vector<std::size_t>& points,
                                    Instant now) {
  store_.OnWritten(device.index, points, now);
}

void DeviceTracker::Doubt(const Device& device, const std::vector<std::size_t>& points,
                          Instant now) {
  store_.Doubt(device.index, points, now);
}

/// A task got no reply, so another device may be there now. Points that are read once or daily
/// would show the values of the old device for a long time, so they become uncertain and are read
/// again.
void DeviceTracker::DoubtSeldom(Device& device, Instant now) {
  std::vector<std::size_t> points;
  for (std::size_t point = 0; point < device.config->points.size(); ++point) {
    if (IsSeldom(device.config->points[point].group)) points.push_back(point);
  }
  if (points.empty()) return;
  store_.Doubt(device.index, points, now);
  agenda_.schedule.Repeat(device.place, config::Group::once, now);
  agenda_.schedule.Repeat(device.place, config::Group::daily, now + SlowOf(device));
}

void DeviceTracker::Repeat(const Device& device, config::Group group, bool soon, Instant now) {
  const Duration least = group == config::Group::daily ? kDailyAgain : Duration::zero();
  const Duration most = IsSeldom(group) ? std::max(SlowOf(device), least) : kLongest;
  if (soon) return agenda_.schedule.RepeatSoon(device.place, group, now, most);
  agenda_.schedule.Repeat(device.place, group, now + most);
}

/// Another device may be connected. Forgets what was learned of the device, and makes all its
/// values uncertain until they are read again.
void DeviceTracker::Reconnect(Device& device, Instant now) {
  device.conversation->OnReconnect();
  device.heard.Clear();
  device.LearnTimes();
  owed_.whose.OnReconnect(device);
  Plan(device);
  DoubtAll(device, now);
}

void DeviceTracker::DoubtAll(const Device& device, Instant now) {
  std::vector<std::size_t> points(device.config->points.size());
  std::iota(points.begin(), points.end(), 0U);
  store_.Doubt(device.index, points, now);
}

void DeviceTracker::GoOnWithPlan(Device& device, Instant now) {
  Replan(device, now);
  agenda_.schedule.GoOn(device.place, now);
}

void DeviceTracker::RestartWithPlan(Device& device, Instant now) {
  Replan(device, now);
  if (device.in_use) agenda_.schedule.RestartAsPlanned(device.place, now);
}

/// Makes a new plan of the queries of a device, and ends its parked jobs. Parked read-backs and
/// parked polls of the groups once and daily are scheduled again; other polls come again anyway.
void DeviceTracker::Replan(Device& device, Instant now) {
  const auto parked = agenda_.parked.TakeAll(device);
  for (const auto& job : parked) {
    const auto group = job->group();
    if (group && IsSeldom(*group)) agenda_.schedule.Repeat(device.place, *group, now);
  }
  Plan(device);
  for (const auto& job : parked) {
    if (job->is_read_back()) ReadBack(device, job->points);
  }
}

/// Gives the queries of the conversation to the schedule. The queries may have other numbers than
/// before, so the queries of waiting read-backs are found by their points.
void DeviceTracker::Plan(Device& device) {
  const auto queries = device.conversation->Queries();
  const auto to_read = agenda_.write_queue.TakeReadBacks(device.place, device.planned_queries);
  device.planned_queries.assign(queries.begin(), queries.end());
  std::vector<config::Group> groups;
  for (const protocols::Query& query : queries) groups.push_back(query.group);
  agenda_.schedule.SetQueries(device.place, std::move(groups), device.conversation->HasEvents());
  agenda_.parked.Drop(device);  // the query of a parked job may have another number now
  ReadBack(device, to_read);
  accounts_.devices.OnPlan(device);
  accounts_.rounds.OnPlan(device);
}

void DeviceTracker::ReadBack(const Device& device, const std::vector<std::size_t>& points) {
  agenda_.write_queue.AddReadBacks(device.place, device.conversation->Queries(), points);
}

void DeviceTracker::PlanBackground(const Device& device) {
  constexpr int kCharacters = 100;  // assumed for an exchange whose duration is not known yet
  const LineTimes& times = device.times;
  agenda_.background.Set(device.place, device.conversation->BackgroundDue(),
                         times.quiet + times.reply + kCharacters * times.character);
  agenda_.background.SetProof(device.place, owed_.whose.ProofRenews(device),
                              owed_.whose.ProofEnds(device));
}

void DeviceTracker::HoldBack(const Member& member) {
  const Instant until = owed_.late_replies.LateUntil(member);
  for (const auto& device : roster_.devices()) {
    if (device->IsSame(member)) agenda_.schedule.Hold(device->place, until);
  }
}

}  // namespace baudgate::bus
