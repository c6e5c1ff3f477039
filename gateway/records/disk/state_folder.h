// `StateFolder` is the folder of the data that outlive the program: one for each gateway.name,
// locked while a gateway runs (docs/state.md).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/base/guarded.h"

namespace baudgate::records {

// A file of a newer version must not be used: it would be misread, or taken for damaged.

/// The version of devices.json and clocks.json. A file without a version number has version 1.
inline constexpr std::int64_t kDevicesVersion = 1;

/// Latest readable version of the tables with this application_id; 0: no file of baudgate.
std::int64_t KnownVersion(std::int64_t application);

/// Returns a sentence that names the first file of a newer version. Does not write to the folder.
std::string NewerStateIn(const std::filesystem::path& folder);

/// True if clients can write through a point, a permitted route, manual telegrams, or a borrowed
/// port.
bool CanWrite(const config::Config& config);

bool KeepsEvents(const config::Config& config);

/// Returns the first feature of this configuration that needs the state folder, such as "events";
/// empty: no feature needs it. `catalog` must contain all protocols of the configuration.
std::string WhatIsKept(const config::Config& config, const config::Catalog& catalog);
inline bool NeedsState(const config::Config& config, const config::Catalog& catalog) {
  return !WhatIsKept(config, catalog).empty();
}

/// The candidates for the state folder. An empty text: not given.
struct StatePlaces {
  std::string configured;       ///< gateway.state
  std::string state_directory;  ///< $STATE_DIRECTORY: a list of folders, separated by ':'
  bool system = false;          ///< kSystemState can be written or made
  std::string xdg_state_home;   ///< $XDG_STATE_HOME
  std::string home;             ///< $HOME

  static StatePlaces Here(const std::string& configured);
};

/// Returns the folder in the first given candidate, in the order of StatePlaces.
std::filesystem::path StateFolderOf(const StatePlaces& places, const std::string& gateway);

/// Empty: events.db is in the state folder.
std::filesystem::path EventsFolderOf(const config::Config& config);
/// Empty: the history is in the state folder.
std::filesystem::path HistoryFolderOf(const config::Config& config);

/// The state folder. A folder that cannot be made or written at the start can become available
/// later, so its users call Open again. All functions can be called on any thread.
class StateFolder {
 public:
  struct Failure {
    /// True: another process uses the folder, or a newer baudgate has written it: the gateway must
    /// not start. False: it cannot be made or written, or its disk does not answer.
    bool in_use = false;
    std::string text;
  };

  explicit StateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  ~StateFolder();
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  /// Makes and locks the folder, again if it was removed. Takes as long as the disk takes.
  std::optional<Failure> Open();
  /// As Open, but waits `patience` at most; opening then continues in the background.
  static std::optional<Failure> OpenWithin(const std::shared_ptr<StateFolder>& folder,
                                           Duration patience);

  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
  Mutex mutex_;
  int lock_ BAUDGATE_GUARDED_BY(mutex_) = -1;
};

}  // namespace baudgate::records
