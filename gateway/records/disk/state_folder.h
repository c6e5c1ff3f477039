// The folder of what has to outlive the program: one for each gateway.name, locked while a gateway
// runs (docs/state.md). NewerStateIn finds files that a newer baudgate has written.
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

// Which files of the state folder a newer baudgate has written: they are not for this one, which
// would read them wrong, or take for damaged what it does not know.

/// The version of devices.json and clocks.json; a file that has none is the first.
inline constexpr std::int64_t kDevicesVersion = 1;

/// The latest version of the tables that this baudgate knows, by the file's application_id; 0: it
/// is no file of ours.
std::int64_t KnownVersion(std::int64_t application);

/// A sentence that names the first file of a newer one; empty: there is none. Nothing is written,
/// whatever is there.
std::string NewerStateIn(const std::filesystem::path& folder);

/// Something can be written: a point of a device, behind a route that a listener permits, or by
/// hand.
bool CanWrite(const config::Config& config);

/// Events are kept: the configuration says so, or one of its devices does.
bool KeepsEvents(const config::Config& config);

/// What of this configuration needs the state folder, or the first of it: "events"; empty: nothing.
/// `catalog` has all its protocols.
std::string WhatIsKept(const config::Config& config, const config::Catalog& catalog);
inline bool NeedsState(const config::Config& config, const config::Catalog& catalog) {
  return !WhatIsKept(config, catalog).empty();
}

/// What the choice rests on. Empty: not given.
struct StatePlaces {
  std::string configured;       ///< gateway.state
  std::string state_directory;  ///< $STATE_DIRECTORY, folders with ':' between them
  bool system = false;          ///< kSystemState can be written, or made
  std::string xdg_state_home;   ///< $XDG_STATE_HOME
  std::string home;             ///< $HOME

  /// The places of this process.
  static StatePlaces Here(const std::string& configured);
};

/// The first place that is given, in the order above, and the gateway's folder in it. Empty: there
/// is none.
std::filesystem::path StateFolderOf(const StatePlaces& places, const std::string& gateway);

/// The databases' folder, if they have their own (events.directory). Empty: they have not, and
/// lie in the state folder.
std::filesystem::path EventsFolderOf(const config::Config& config);
/// The same of the values that are kept (history.directory).
std::filesystem::path HistoryFolderOf(const config::Config& config);

/// A folder that cannot be made or written at the start may be so later: whoever needs it asks
/// again. From any thread.
class StateFolder {
 public:
  struct Failure {
    /// By another process, or by a newer baudgate whose files are there: the gateway must not
    /// start. Else it cannot be made or written, or its disk does not answer.
    bool in_use = false;
    std::string text;
  };

  explicit StateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  ~StateFolder();
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  /// Makes the folder where it is not there, and locks it; again where somebody has removed it. As
  /// long as the disk takes.
  std::optional<Failure> Open();
  /// The same; a disk that takes longer than `patience` goes on opening it meanwhile.
  static std::optional<Failure> OpenWithin(const std::shared_ptr<StateFolder>& folder,
                                           Duration patience);

  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
  Mutex mutex_;
  int lock_ BAUDGATE_GUARDED_BY(mutex_) = -1;
};

}  // namespace baudgate::records
