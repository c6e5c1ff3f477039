// The copies of the configuration in the state folder, as the next start needs them. No caller
// waits long for the disk: a write that comes too late is corrected at the next look.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <functional>
#include <optional>
#include <string>

#include "gateway/base/result.h"
#include "gateway/daemon/reload/kept_configs.h"
#include "gateway/records/disk/disk_calls.h"

namespace baudgate {

/// All is called on one thread, or while it does not run: that of `loop`.
class ConfigCopies {
 public:
  /// `kept` empty: there is no folder. `open_folder` makes and locks it.
  ConfigCopies(asio::io_context& loop, std::optional<reload::KeptConfigs> kept, Duration patience,
               std::function<Status()> open_folder);

  /// Something was kept before.
  bool found() const { return kept_ && !kept_->empty(); }
  /// Empty: there is none.
  std::string folder() const { return kept_ ? kept_->folder().string() : std::string(); }

  /// Opens the folder if that was not done yet, and writes `texts`.
  Status Keep(const reload::KeptTexts& texts);
  /// Writes the copies that differ from `texts`, if the folder is open: a copy may have been
  /// removed or changed, or a full disk may have room again. `seen` gets why they cannot be
  /// written, later or at once; empty: they are up to date.
  void Look(const reload::KeptTexts& texts,
            std::function<void(std::optional<std::string> trouble)> seen);
  /// As long as the disk takes. Idempotent.
  void Stop() { calls_.Stop(); }

 private:
  Status Open();
  std::optional<std::string> Trouble(const Result<bool>& written);

  asio::io_context& loop_;
  const std::optional<reload::KeptConfigs> kept_;
  const std::function<Status()> open_folder_;
  bool open_ = false;                   // the folder is ours
  std::optional<std::string> trouble_;  // as it was said last
  DiskCalls calls_;
};

}  // namespace baudgate
