// The configuration that runs, as outputs show it: its state, its text, and the end of its trial.
// Written by the reloader's thread (gateway/daemon/reloader.h), read by any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/outputs/status/reload_state.h"

namespace baudgate {

class ReloadDisplay {
 public:
  void Change(const std::function<void(control::ReloadState&)>& change) {
    const MutexLock lock(mutex_);
    change(state_);
  }
  /// The text that runs from now on, with its secrets.
  void SetText(std::shared_ptr<const std::string> text) {
    const MutexLock lock(mutex_);
    text_ = std::move(text);
  }
  /// The configuration of the file runs, on trial until then; empty: for good.
  void SetTrial(std::optional<Instant> until) {
    const MutexLock lock(mutex_);
    state_.not_the_file.clear();
    state_.file_changed.clear();
    until_ = until;
  }

  control::ReloadState StateAt(Now now) const {
    const MutexLock lock(mutex_);
    control::ReloadState state = state_;
    if (until_) state.confirm_until = now.wall + (*until_ - now.instant);
    return state;
  }
  /// Null before the start.
  std::shared_ptr<const std::string> text() const {
    const MutexLock lock(mutex_);
    return text_;
  }

 private:
  mutable Mutex mutex_;
  control::ReloadState state_ BAUDGATE_GUARDED_BY(mutex_);
  std::shared_ptr<const std::string> text_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Instant> until_ BAUDGATE_GUARDED_BY(mutex_);  // of the trial
};

}  // namespace baudgate
