// Writes what flight recorders hold into files that `baudgate decode` reads. Recordings come from
// gateway/records/trace/line_recorder.h on the lines' threads; one thread here does the writing.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "config/model/config.h"
#include "gateway/base/worker.h"
#include "gateway/records/trace/line_recorder.h"

namespace baudgate {

class Recordings {
 public:
  static constexpr std::size_t kFilesPerLine = 20;
  /// Recordings that wait for a slow disk; further ones are dropped.
  static constexpr std::size_t kMostWaiting = 16;

  /// config.recordings, else the first folder of $STATE_DIRECTORY with /recordings; empty: nowhere.
  static std::filesystem::path FolderOf(const config::Config& config);

  /// A failed write is tried again after this time.
  static constexpr Duration kAgain = 10s;

  /// `trouble` gets why nothing can be written by now, or an empty text; from the writing thread.
  /// Its end waits until all that waits is written.
  Recordings(std::filesystem::path folder, std::string version,
             std::function<void(const std::string&)> trouble);

  /// From any thread; returns at once.
  void Save(Recording recording);

 private:
  /// As it will be in the folder.
  struct File {
    std::string line;
    std::string name;
    std::string contents;
  };
  void WriteAll();
  void Write(const File& file);
  void DropOldest(const std::string& line) const;

  const std::filesystem::path folder_;
  const std::string version_;
  const std::function<void(const std::string&)> trouble_;
  std::optional<File> failed_;  // the latest that could not be written; of the writing thread
  WorkQueue<Recording> waiting_{kMostWaiting};
  Worker worker_;
};

}  // namespace baudgate
