// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/records.h"

#include <functional>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/worker.h"

namespace baudgate::records {

std::vector<std::string> FileTroubles::Held::All() const {
  std::vector<std::string> all;
  const MutexLock lock(mutex);
  for (const auto& [file, trouble] : troubles) all.push_back(trouble);
  return all;
}

std::string FileTroubles::Held::Set(const std::string& file, const std::string& trouble) {
  const MutexLock lock(mutex);
  if (trouble.empty()) {
    const auto found = troubles.extract(file);
    return found.empty() ? std::string() : found.mapped();
  }
  return std::exchange(troubles[file], trouble);
}

std::function<void(const std::string& trouble)> FileTroubles::Reporter(const std::string& file) {
  return [held = held_, file](const std::string& trouble) {
    const std::string was = held->Set(file, trouble);
    if (was.empty() && !trouble.empty()) log::Warn("{}", trouble);
    if (!was.empty() && trouble.empty()) log::Info("{} is written again", file);
  };
}

namespace {

audit::AuditLog::Options OptionsOf(const config::Config& config, const EventsPlace& place,
                                   WritePath::Unsettled unsettled) {
  audit::AuditLog::Options options;
  options.file = place.file;
  options.why_no_file = place.why_no_file;
  options.writer = place.writer;
  options.require = config.audit == config::Audit::require;
  options.clocks = ReadClocks;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  options.unsettled = std::move(unsettled);
  return options;
}

}  // namespace

WritePath::WritePath(const config::Config& config, const bus::PointStore& store,
                     bus::CommandSink& lines, const EventsPlace& place, Unsettled unsettled)
    : unsettled_(std::move(unsettled)),
      log_(OptionsOf(config, place,
                     [this](const std::set<audit::Target>& devices) { OnUnsettled(devices); })),
      audited_(store, lines, log_, config.audit, ReadClocks) {}

void WritePath::OnUnsettled(const std::set<audit::Target>& devices) {
  {
    const MutexLock lock(mutex_);
    if (!started_) {
      early_ = devices;
      return;
    }
  }
  unsettled_(devices);
}

void WritePath::Start() {
  audited_.Start();
  std::set<audit::Target> early;
  {
    const MutexLock lock(mutex_);
    started_ = true;
    early.swap(early_);
  }
  if (!early.empty()) unsettled_(early);
}

namespace {

/// The longest wait for a disk that does not answer. At a start, lines and listeners do not begin
/// before it ends.
constexpr Duration kFolderPatience = 2s;

std::function<Status()> ReadyOf(std::shared_ptr<StateFolder> folder) {
  return [folder = std::move(folder)]() -> Status {
    if (const auto failure = folder->Open()) return Error{failure->text};
    return {};
  };
}

}  // namespace

Status Records::Open(const config::Config& config, const Links& links) {
  if (Status status = OpenFolder(config); !status) return status;
  EventsPlace place;
  if (Status status = PlaceEvents(config, place); !status) return status;
  if (Status status = PlaceHistory(config); !status) return status;
  StartHistory({std::shared_ptr<void>(), &config}, links.store);
  writes_ = std::make_unique<WritePath>(config, links.store, links.lines, place, links.unsettled);
  keeps_events_ = KeepsEvents(config);
  place.in_memory = !keeps_events_;
  if (place.in_memory) place.file.clear();
  MakeEvents(config, links, place);
  if (state_ && why_no_state_.empty()) {
    memory_ = std::make_unique<DeviceMemory>(
        state_->path() / "devices.json", config,
        [](const std::string& trouble) { log::Warn("{}", trouble); },
        links.troubles.Reporter("devices.json"));
    return {};
  }
  log::Warn(
      "state: {}: data learned from devices is lost at the next start. Set a folder in "
      "gateway.state",
      why_no_state_);
  return {};
}

void Records::OpenAlarms(const config::Config& config, const Links& links) {
  EventsPlace place;
  place.in_memory = true;
  MakeEvents(config, links, place);
}

void Records::MakeEvents(const config::Config& config, const Links& links, EventsPlace place) {
  place.consumers = links.consumers;
  auto events = std::make_unique<EventPath>(config, links.store, place, links.lines, links.kept);
  const MutexLock lock(mutex_);
  events_ = std::move(events);
}

Status Records::OpenFolder(const config::Config& config) {
  const auto path = StateFolderOf(StatePlaces::Here(config.state), config.name);
  if (!state_ && path.empty()) {
    why_no_state_ = "neither gateway.state nor HOME is set";
    return {};
  }
  if (!state_) state_ = std::make_shared<StateFolder>(path);
  const auto failure = StateFolder::OpenWithin(state_, kFolderPatience);
  why_no_state_ = failure ? failure->text : std::string();
  if (!failure || !failure->in_use) return {};
  state_.reset();
  return Error{failure->text};
}

Status Records::PlaceEvents(const config::Config& config, EventsPlace& place) {
  constexpr const char* kEventsFile = "events.db";
  std::shared_ptr<StateFolder> folder = state_;
  if (const auto path = EventsFolderOf(config); !path.empty()) {
    databases_ = folder = std::make_shared<StateFolder>(path);
    const auto failure = StateFolder::OpenWithin(folder, kFolderPatience);
    if (failure && failure->in_use) return Error{failure->text};
  }
  place.why_no_file = "no state folder: " + why_no_state_;
  if (!folder) return {};
  place.file = folder->path() / kEventsFile;
  place.writer->ready = ReadyOf(folder);
  return {};
}

Status Records::PlaceHistory(const config::Config& config) {
  const auto path = HistoryFolderOf(config);
  history_folder_ = state_;
  if (!path.empty() && databases_ && databases_->path() == path) {
    history_folder_ = databases_;
  } else if (!path.empty() && config.history.on()) {
    history_folder_ = std::make_shared<StateFolder>(path);
    const auto failure = StateFolder::OpenWithin(history_folder_, kFolderPatience);
    if (failure && failure->in_use) return Error{failure->text};
  }
  return {};
}

void Records::StartHistory(const std::shared_ptr<const config::Config>& config,
                           bus::PointStore& store) {
  if (!config->history.on()) return;
  history::HistoryLog::Options options;
  options.config = config.get();
  options.store = &store;
  options.why_no_folder = "the history has no folder: " + why_no_state_;
  if (history_folder_) {
    options.folder = history_folder_->path();
    options.ready = ReadyOf(history_folder_);
  }
  if (history_ends_.valid()) {
    options.taken = [ends = history_ends_] {
      return ends.wait_for(Duration::zero()) != std::future_status::ready;
    };
  }
  options.clocks = ReadClocks;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  RunningHistory history{config, std::make_unique<history::HistoryLog>(std::move(options))};
  const MutexLock lock(mutex_);
  history_ = std::move(history);
}

void Records::OnReload(const std::shared_ptr<const config::Config>& config,
                       std::span<const std::shared_ptr<const config::Line>> begun) {
  if (memory_) memory_->OnReload(*config);
  if (EventPath* const its = events()) its->Renumber(config, begun);
}

void Records::RenewHistory(const std::shared_ptr<const config::Config>& config,
                           bus::PointStore& store) {
  auto ends = std::make_shared<RunningHistory>();
  {
    const MutexLock lock(mutex_);
    std::swap(*ends, history_);
  }
  if (ends->log) {
    const auto before = history_ends_;
    auto ended = std::make_shared<std::promise<void>>();
    history_ends_ = ended->get_future().share();
    const auto end = [ends, before, ended] {
      ends->log.reset();
      if (before.valid()) before.wait();
      ended->set_value();
    };
    if (!StartDetached("history ends", end)) end();
    history_ends_.wait_for(kFolderPatience);
  }
  StartHistory(config, store);
}

// In EndHistory and EndEvents, `ends` is destroyed after the lock is released: its destructor can
// wait for the disk, and readers of mutex_ must not wait for that.

void Records::EndHistory() {
  if (history_ends_.valid()) history_ends_.wait();
  RunningHistory ends;
  const MutexLock lock(mutex_);
  std::swap(ends, history_);
}

void Records::EndEvents() {
  std::unique_ptr<EventPath> ends;
  const MutexLock lock(mutex_);
  ends.swap(events_);
}

void Records::Look(Now now, const std::optional<std::string>& certificates) {
  const MutexLock lock(mutex_);
  if (!events_) return;
  if (certificates) events_->OnCertificates(*certificates, now);
  events_->Look(LookAtDisks(now), now);
}

std::vector<AlarmService::DiskState> Records::LookAtDisks(Now now) {
  constexpr Duration kEvery = 1s;
  if (disks_at_ && now.instant - *disks_at_ < kEvery) return {};
  disks_at_ = now.instant;
  std::vector<AlarmService::DiskState> disks;
  const auto add = [&](events::Trouble trouble, const auto& state) {
    disks.push_back({trouble, state.disk, state.trouble});
  };
  if (keeps_events_) events_->log().Watch();
  if (writes_) writes_->log().Watch();
  if (keeps_events_) add(events::Trouble::events_lost, events_->log().state());
  if (writes_) add(events::Trouble::writes_lost, writes_->log().state());
  if (history_.log) add(events::Trouble::values_lost, history_.log->view()->state());
  return disks;
}

}  // namespace baudgate::records
