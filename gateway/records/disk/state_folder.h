// `StateFolder` is the folder of the data that outlive the program: one for each gateway.name,
// locked while a gateway runs (docs/state.md). `NewerStateIn` finds files that a newer baudgate has
// written.
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

// Detects files of the state folder that a newer baudgate has written. This version must not use
// them: it would misread them, or take unknown contents for damage.

/// The version of devices.json and clocks.json; a file without a version has version 1.
inline constexpr std::int64_t kDevicesVersion = 1;

/// The latest version of the tables that this program can read, by the file's application_id; 0:
/// the id of no baudgate file.
std::int64_t KnownVersion(std::int64_t application);

/// A sentence that names the first file of a newer version; empty: there is none. Does not write to
/// the folder.
std::string NewerStateIn(const std::filesystem::path& folder);

/// True if clients can write: to a point of a device, through a route that a listener permits, or
/// by manual telegrams.
bool CanWrite(const config::Config& config);

bool KeepsEvents(const config::Config& config);

/// The first part of this configuration that needs the state folder: "events"; empty: none.
/// `catalog` must contain all its protocols.
std::string WhatIsKept(const config::Config& config, const config::Catalog& catalog);
inline bool NeedsState(const config::Config& config, const config::Catalog& catalog) {
  return !WhatIsKept(config, catalog).empty();
}

/// The candidates for the state folder. Empty: not given.
struct StatePlaces {
  std::string configured;       ///< gateway.state
  std::string state_directory;  ///< list of folders, separated by ':'
  bool system = false;          ///< kSystemState can be written, or made
  std::string xdg_state_home;   ///< $XDG_STATE_HOME
  std::string home;             ///< $HOME

  static StatePlaces Here(const std::string& configured);
};

/// Returns the gateway's folder in the first place that is given, in the order above. Empty: no
/// place is given.
std::filesystem::path StateFolderOf(const StatePlaces& places, const std::string& gateway);

/// The separate folder of events.db (events.directory). Empty: it is in the state folder.
std::filesystem::path EventsFolderOf(const config::Config& config);
/// The separate folder of the history (history.directory). Empty: it is in the state folder.
std::filesystem::path HistoryFolderOf(const config::Config& config);

/// The state folder. A folder that cannot be made or written at the start may become available
/// later, so its users call Open again. All functions may be called on any thread.
class StateFolder {
 public:
  struct Failure {
    /// True if another process uses the folder, or a newer baudgate has written its files: the
    /// gateway must not start. False: the folder cannot be made or written, or its disk does not
    /// answer.
    bool in_use = false;
    std::string text;
  };

  explicit StateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  ~StateFolder();
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  /// Makes the folder if it does not exist, and locks it; also after it was removed. Takes as long
  /// as the disk takes.
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
