// Which configuration the gateway runs with, as `baudgate status` says it. Written by
// gateway/daemon/reloader.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/time.h"

namespace baudgate::control {

struct ReloadState {
  std::string file;    ///< of the configuration
  std::string folder;  ///< of the confirmed copy; empty: none is kept
  WallTime applied{};  ///< what runs now
  /// Until then somebody has to confirm it, or the one before is taken again.
  std::optional<WallTime> confirm_until{};
  /// Why `file` is not what runs: a sentence; empty: it is, for all that is known.
  std::string not_the_file;
  /// What was found when the file was looked at last: it differs from what runs, or cannot be read.
  /// A sentence; empty: neither.
  std::string file_changed;
  /// Why the confirmed copy cannot be written; empty: it is written.
  std::string not_kept;
};

}  // namespace baudgate::control
