// `StateFolder` is the folder of the data that outlive the program. There is one for each
// gateway.name, locked while a gateway runs (docs/state.md).
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

// These functions detect files of the state folder that a newer baudgate has written. This version
// must not use such files: it would misread them, or take unknown contents for damage.

/// The version of devices.json and clocks.json. A file without a version number has version 1.
inline constexpr std::int64_t kDevicesVersion = 1;

/// Returns the latest version of the tables that this program can read. `application`: the file's
/// application_id. 0: no file of baudgate has this id.
std::int64_t KnownVersion(std::int64_t application);

/// Returns a sentence that names the first file of a newer version; empty: there is no such file.
/// Does not write to the folder.
std::string NewerStateIn(const std::filesystem::path& folder);

/// True if clients can write to devices: to a point, through a route that a listener permits, by
/// manual telegrams, or with a lent port.
bool CanWrite(const config::Config& config);

bool KeepsEvents(const config::Config& config);

/// Returns the first feature of this configuration that needs the state folder, such as "events";
/// empty: no feature needs it. `catalog` must contain all protocols of the configuration.
std::string WhatIsKept(const config::Config& config, const config::Catalog& catalog);
inline bool NeedsState(const config::Config& config, const config::Catalog& catalog) {
  return !WhatIsKept(config, catalog).empty();
}

/// The candidates for the state folder; the first given one is used. An empty text: not given.
struct StatePlaces {
  std::string configured;       ///< gateway.state
  std::string state_directory;  ///< $STATE_DIRECTORY: a list of folders, separated by ':'
  bool system = false;          ///< true: kSystemState can be written or made
  std::string xdg_state_home;
  std::string home;

  static StatePlaces Here(const std::string& configured);
};

/// Returns the gateway's folder in the first candidate that is given. Empty: no candidate is given.
std::filesystem::path StateFolderOf(const StatePlaces& places, const std::string& gateway);

/// Returns the separate folder of events.db (events.directory). Empty: events.db is in the state
/// folder.
std::filesystem::path EventsFolderOf(const config::Config& config);
/// Returns the separate folder of the history (history.directory). Empty: the history is in the
/// state folder.
std::filesystem::path HistoryFolderOf(const config::Config& config);

/// The state folder. A folder that cannot be made or written at the start can become available
/// later, so its users call Open again. All functions can be called on any thread.
class StateFolder {
 public:
  struct Failure {
    /// True: another process uses the folder, or a newer baudgate has written its files, so the
    /// gateway must not start. False: the folder cannot be made or written, or its disk does not
    /// answer.
    bool in_use = false;
    std::string text;
  };

  explicit StateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  ~StateFolder();
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  /// Makes the folder if it does not exist, and locks it. If the folder was removed since the last
  /// call, does both again. Takes as long as the disk takes.
  std::optional<Failure> Open();
  /// Opens the folder, but returns a failure after `patience`, and goes on opening in the
  /// background.
  static std::optional<Failure> OpenWithin(const std::shared_ptr<StateFolder>& folder,
                                           Duration patience);

  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
  Mutex mutex_;
  int lock_ BAUDGATE_GUARDED_BY(mutex_) = -1;
};

}  // namespace baudgate::records
