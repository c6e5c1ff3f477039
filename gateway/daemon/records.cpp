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
  if (KeepsEvents(config)) {
    events_ = std::make_unique<EventPath>(config, links.store, place, links.lines, links.kept);
  }
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
  history_ = MakeHistory(config, store, history_folder_, why_no_history_folder_);
}

void Records::Renumber(const std::shared_ptr<const config::Config>& config,
                       std::span<const std::shared_ptr<const config::Line>> begun) {
  if (memory_) memory_->Renumber(*config);
  if (events_) events_->Renumber(config, begun);
}

void Records::RenewHistory(const config::Config& config, PointStore& store) {
  history_.reset();  // it has the files
  StartHistory(config, store);
}

}  // namespace baudgate
