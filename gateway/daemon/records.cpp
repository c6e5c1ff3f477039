// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/records.h"

#include <utility>

#include "gateway/base/log.h"
#include "gateway/daemon/history_path.h"

namespace baudgate {

Status Records::Open(const config::Config& config, const Links& links) {
  if (Status status = OpenFolder(config); !status) return status;
  EventsPlace place;
  if (Status status = PlaceEvents(config, why_no_state_, place); !status) return status;
  if (Status status = PlaceHistory(config); !status) return status;
  StartHistory(config, links.store);
  writes_ = std::make_unique<WritePath>(config, links.store, links.lines, place);
  keeps_events_ = KeepsEvents(config);
  place.in_memory = !keeps_events_;
  if (place.in_memory) place.file.clear();
  MakeEvents(config, links, place);
  if (state_) {
    memory_ = std::make_unique<DeviceMemory>(
        state_->path() / "devices.json", config,
        [](const std::string& trouble) { log::Warn("{}", trouble); });
    return {};
  }
  log::Warn(
      "state: {}: what is learned of devices is forgotten at the next start; give a folder with "
      "gateway.state",
      why_no_state_);
  return {};
}

void Records::OpenAlarms(const config::Config& config, const Links& links) {
  EventsPlace place;
  place.in_memory = true;
  MakeEvents(config, links, place);
}

void Records::MakeEvents(const config::Config& config, const Links& links,
                         const EventsPlace& place) {
  auto events = std::make_unique<EventPath>(config, links.store, place, links.lines, links.kept);
  const MutexLock lock(mutex_);
  events_ = std::move(events);
}

Status Records::OpenFolder(const config::Config& config) {
  if (state_) return {};
  const auto path = StateFolderOf(StatePlaces::Here(config.state), config.name);
  StateFolder::Failure failure{false, "there is no place for it"};
  if (!path.empty()) state_ = StateFolder::Open(path, failure);
  if (failure.in_use) return Error{failure.text};
  why_no_state_ = failure.text;
  return {};
}

/// In a folder of their own, if the configuration gives one.
Status Records::PlaceEvents(const config::Config& config, const std::string& why_no_state,
                            EventsPlace& place) {
  constexpr const char* kEventsFile = "events.db";
  StateFolder::Failure failure{false, why_no_state};
  if (const auto path = EventsFolderOf(config); !path.empty()) {
    databases_ = StateFolder::Open(path, failure);
    if (failure.in_use) return Error{failure.text};
    if (databases_) place.file = databases_->path() / kEventsFile;
  } else if (state_) {
    place.file = state_->path() / kEventsFile;
  }
  place.why_no_file = "there is no state folder for it: " + failure.text;
  return {};
}

/// In a folder of its own, if the configuration gives one.
Status Records::PlaceHistory(const config::Config& config) {
  StateFolder::Failure failure{false, why_no_state_};
  const auto path = HistoryFolderOf(config);
  const StateFolder* folder = state_.get();
  if (!path.empty() && databases_ && databases_->path() == path) {
    folder = databases_.get();
  } else if (!path.empty() && config.history.on()) {
    histories_ = StateFolder::Open(path, failure);
    if (failure.in_use) return Error{failure.text};
    folder = histories_.get();
  }
  if (folder != nullptr) history_folder_ = folder->path();
  why_no_history_folder_ = "there is no folder for it: " + failure.text;
  return {};
}

void Records::StartHistory(const config::Config& config, PointStore& store) {
  if (!config.history.on()) return;
  auto history = MakeHistory(config, store, history_folder_, why_no_history_folder_);
  const MutexLock lock(mutex_);
  history_ = std::move(history);
}

void Records::Renumber(const std::shared_ptr<const config::Config>& config,
                       std::span<const std::shared_ptr<const config::Line>> begun) {
  if (memory_) memory_->Renumber(*config);
  if (EventPath* const its = events()) its->Renumber(config, begun);
}

void Records::RenewHistory(const config::Config& config, PointStore& store) {
  EndHistory();  // it has the files
  StartHistory(config, store);
}

// What ends may wait for the disk, and holds up nobody who looks meanwhile.

void Records::EndHistory() {
  std::unique_ptr<history::HistoryLog> ends;
  const MutexLock lock(mutex_);
  ends.swap(history_);
}

void Records::EndEvents() {
  std::unique_ptr<EventPath> ends;
  const MutexLock lock(mutex_);
  ends.swap(events_);
}

void Records::Look(Now now) {
  const MutexLock lock(mutex_);
  if (events_) events_->Look(LookAtDisks(now), now);
}

std::vector<AlarmDesk::DiskState> Records::LookAtDisks(Now now) {
  constexpr Duration kEvery = 1s;
  if (disks_at_ && now.instant - *disks_at_ < kEvery) return {};
  disks_at_ = now.instant;
  std::vector<AlarmDesk::DiskState> disks;
  const auto add = [&](events::Trouble trouble, const auto& state) {
    disks.push_back({trouble, state.disk, state.trouble});
  };
  if (keeps_events_) add(events::Trouble::events_lost, events_->log().state());
  if (writes_) add(events::Trouble::writes_lost, writes_->log().state());
  if (history_) add(events::Trouble::values_lost, history_->state());
  return disks;
}

}  // namespace baudgate
