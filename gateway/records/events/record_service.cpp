// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/record_service.h"

#include <algorithm>

namespace baudgate::events {
namespace {

events::KeptRecord RecordFor(const events::OwedRecord& owed) {
  events::KeptRecord record;
  record.kind = events::kEventRecord;
  record.line = owed.line;
  record.device = owed.device;
  record.name = owed.name;
  record.event = owed.event;
  record.device_time = owed.device_time;
  record.clock = owed.clock;
  return record;
}

events::KeptRecord Superseded(const events::OwedRecord& owed, std::int64_t by, WallTime now) {
  events::KeptRecord record = RecordFor(owed);
  record.state = events::RecordState::superseded;
  record.text = "event " + std::to_string(by) + " came before this record was read";
  record.read = now;
  return record;
}

events::KeptRecord NotRead(std::string why, WallTime now) {
  events::KeptRecord record;
  record.state = events::RecordState::not_read;
  record.text = std::move(why);
  record.read = now;
  return record;
}

/// True if the device has reported that the point does not exist; such a point is not read any
/// more.
bool IsGivenUp(const bus::PointRecord& point) {
  return point.reported == Quality::bad_configuration;
}

}  // namespace

void RecordService::Add(const std::shared_ptr<const config::Line>& line) {
  const MutexLock lock(mutex_);
  for (const config::Device& device : line->devices) {
    const auto index = static_cast<std::uint32_t>(debts_.size());
    std::vector<Debt>& debts = debts_.emplace_back();
    for (const config::Record& record : device.records) {
      debts.push_back({.device = index, .record = {line, &record}});
    }
  }
}

void RecordService::Start() {
  Steps steps;
  {
    const MutexLock lock(mutex_);
    started_ = true;
    for (std::vector<Debt>& debts : debts_) {
      for (Debt& debt : debts) {
        if (debt.event) Ask(debt, steps);
      }
    }
  }
  Do(std::move(steps));
}

/// Finds the Debt by the names of the device and the record, because the device can have moved to
/// another line. Returns the Debt of a removed device if no other device has the name: a reload is
/// then under way, and TakeOver follows.
RecordService::Debt* RecordService::Find(const events::OwedRecord& owed) {
  Debt* gone = nullptr;
  for (std::uint32_t device = 0; device < debts_.size(); ++device) {
    const auto its = store_.device(device);
    if (!its || its->name != owed.device) continue;
    for (Debt& debt : debts_[device]) {
      if (!debt.record || debt.record->name != owed.name) continue;
      if (!store_.gone(device)) return &debt;
      gone = &debt;
    }
  }
  return gone;
}

void RecordService::TakeOver() {
  std::vector<events::OwedRecord> owed;
  {
    const MutexLock lock(mutex_);
    for (std::uint32_t device = 0; device < debts_.size(); ++device) {
      if (!store_.gone(device)) continue;
      for (Debt& debt : debts_[device]) {
        debt.got.reset();
        debt.record.reset();
        const auto event = std::exchange(debt.event, std::nullopt);
        if (!event) continue;
        owed.push_back(*event);
        --owing_;
      }
    }
  }
  Owe(owed);
}

void RecordService::Owe(const std::vector<events::OwedRecord>& owed) {
  const Now now = ends_.clocks();
  Steps steps;
  {
    const MutexLock lock(mutex_);
    for (const events::OwedRecord& one : owed) {
      Debt* const debt = Find(one);
      if (debt == nullptr) {
        auto record = RecordFor(one);
        record.state = events::RecordState::not_read;
        record.text = "the configuration no longer has this record of the device";
        record.read = now.wall;
        steps.keep.push_back(std::move(record));
        continue;
      }
      if (debt->event && debt->event->event > one.event) {
        steps.keep.push_back(Superseded(one, debt->event->event, now.wall));
        continue;
      }
      // While the device still has events to report, a later event could make the values useless,
      // and reading them would delay these events.
      const auto its = store_.device(debt->device);
      debt->waits = its && its->events;
      if (!debt->event) debt->again = now.instant + kAgain;
      if (debt->event) {
        steps.keep.push_back(Superseded(*debt->event, one.event, now.wall));
      } else {
        ++owing_;
      }
      debt->event = one;
      debt->got.reset();
      debt->tries = 0;
      debt->stale = debt->asking;
      if (!debt->waits) Ask(*debt, steps);
    }
  }
  Do(std::move(steps));
}

void RecordService::OnDrained(std::uint32_t device, Instant asked) {
  if (owing_ == 0) return;
  Steps steps;
  {
    const MutexLock lock(mutex_);
    for (Debt& debt : debts_[device]) {
      if (debt.waits) Ask(debt, steps);
      if (!debt.got || asked < debt.got_at) continue;
      --owing_;
      Settle(debt, *debt.got, steps);
    }
  }
  Do(std::move(steps));
}

void RecordService::OnRead(std::uint32_t device, Instant at) {
  if (owing_ == 0) return;
  Steps steps;
  {
    const MutexLock lock(mutex_);
    for (Debt& debt : debts_[device]) {
      if (!debt.event) continue;
      if (!debt.got && at >= debt.again) Ask(debt, steps);
      if (!debt.got || at - debt.got_at < kUnproven) continue;
      events::KeptRecord& record = *debt.got;
      record.text = "the values may belong to a later event";
      for (events::RecordValue& value : record.values) {
        if (IsGood(value.quality)) value.quality = Quality::uncertain;
      }
      --owing_;
      Settle(debt, record, steps);
    }
  }
  Do(std::move(steps));
}

void RecordService::Ask(Debt& debt, Steps& steps) {
  if (!started_ || std::exchange(debt.asking, true)) return;
  debt.stale = debt.waits = false;
  steps.ask.push_back({&debt, debt.record});
}

void RecordService::OnAnswer(Debt& debt, Instant asked, const WriteResult& result) {
  const Now now = ends_.clocks();
  std::shared_ptr<const config::Record> its;
  {
    const MutexLock lock(mutex_);
    its = debt.record;
    if (!its) return;
  }
  auto [away, record, read_at] = Look(debt.device, *its, asked, now);
  const auto device = store_.device(debt.device);
  Steps steps;
  {
    const MutexLock lock(mutex_);
    debt.asking = false;
    if (!debt.event) return;
    if (std::exchange(debt.stale, false)) {
      if (!debt.waits) Ask(debt, steps);
    } else if (record && device && !device->events) {
      --owing_;
      Settle(debt, *record, steps);
    } else if (record) {
      debt.got = std::move(record);
      debt.got_at = read_at;
    } else {
      debt.again = now.instant + kAgain;
      // A request that was not sent, for example to an offline device, does not count as a try.
      away = away || result.end == WriteEnd::not_sent;
      if (!away && ++debt.tries >= kTries) {
        --owing_;
        const std::string why =
            result.reason.empty() ? "not all values of the record could be read" : result.reason;
        Settle(debt, NotRead(why, now.wall), steps);
      }
    }
  }
  Do(std::move(steps));
}

/// Builds the record from the last values of its points. Returns no record if a point was not read
/// since `asked`, or if the device is away.
RecordService::Found RecordService::Look(std::uint32_t device_number, const config::Record& its,
                                         Instant asked, Now now) const {
  Found found;
  events::KeptRecord record;
  record.read = now.wall;
  bool all = true;
  const bool known = store_.Read(device_number, [&](const bus::DeviceRecord& device) {
    found.away = device.override_quality.has_value();
    for (const std::uint32_t index : its.points) {
      const config::Point& point = device.device->points[index];
      const bus::PointRecord& held = device.points[index];
      const bool read = held.read_at && *held.read_at > asked;
      all = all && (read || IsGivenUp(held));
      if (read) found.read_at = std::max(found.read_at, *held.read_at);
      const Quality quality = QualityAt(device, index, now.instant);
      record.values.push_back(
          {point.name, IsBad(quality) ? Value() : held.value, point.unit, quality});
    }
  });
  if (!known) found.away = true;
  if (all && !found.away) found.record = std::move(record);
  return found;
}

void RecordService::Settle(Debt& debt, const events::KeptRecord& record, Steps& steps) {
  auto& kept = steps.keep.emplace_back(RecordFor(*debt.event));
  kept.read = record.read;
  kept.state = record.state;
  kept.text = record.text;
  kept.values = record.values;
  debt.event.reset();
  debt.got.reset();
  debt.tries = 0;
}

void RecordService::Do(Steps steps) {
  for (events::KeptRecord& record : steps.keep) ends_.keep(std::move(record));
  for (const auto& [debt, record] : steps.ask) {
    bus::WriteCommand command;
    const Instant now = ends_.clocks().instant;
    command.device = debt->device;
    command.client = "events";
    command.kind = bus::Reads{record->points};
    command.deadline = now + kWaitForPoints;
    command.done = [this, debt = debt, now](const WriteResult& result) {
      OnAnswer(*debt, now, result);
    };
    if (ends_.ask(std::move(command))) continue;
    const MutexLock lock(mutex_);
    debt->asking = false;
    debt->again = now + kAgain;
  }
}

}  // namespace baudgate::events
