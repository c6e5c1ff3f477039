// Applies a changed configuration file while the gateway runs, on request (SIGHUP, `baudgate
// reload`); an edit alone is only shown in the status. Reads the file, says what it changes, has it
// applied, keeps a copy, and takes it back if it is not confirmed. On a thread of its own; lines,
// outputs and the watchdog do not wait for it, and it does not wait for a disk. ReloadDisplay shows
// the configuration that runs, ConfigFile reads the user's file, and ConfigCopies keeps copies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/daemon/reload/difference.h"
#include "gateway/daemon/reload/trial.h"
#include "gateway/outputs/control/request.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/records/disk/disk.h"
#include "transports/loop_thread.h"

namespace baudgate::daemon {

// How a gateway that was started from a file reads that file again. Provided by the program that
// starts it.

/// A text as a configuration, or why it is invalid.
struct LoadedText {
  std::optional<config::Config> config;
  std::vector<std::string> problems;  ///< "…yaml:7:3: …"; only warnings if there is a configuration
};

struct ReloadOptions {
  std::string file;
  std::function<Result<std::string>()> read;                ///< the file, as it is now
  std::function<LoadedText(const std::string& text)> load;  ///< paths in it are the file's
  std::function<void(const std::string& state)> notify;     ///< as sd_notify
  std::function<std::string()> summary;                     ///< what runs, for READY=1
  /// A text without its secrets; empty: they cannot be found.
  std::function<Result<std::string>(const std::string& text)> masked{};
  std::string text_at_start;                ///< the text that runs
  std::optional<reload::Refused> refused;   ///< the text of the file, if it was taken back
  std::optional<reload::KeptConfigs> kept;  ///< empty: there is no folder
  Duration disk_patience = 5s;              ///< how long an answer waits for a file
};

// The configuration that runs, as outputs show it: its state, its text, and the end of its trial.
// Written by the reloader's thread, read by any thread.
class ReloadDisplay {
 public:
  void Change(const std::function<void(status::ReloadState&)>& change) {
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

  status::ReloadState StateAt(Now now) const {
    const MutexLock lock(mutex_);
    status::ReloadState state = state_;
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
  status::ReloadState state_ BAUDGATE_GUARDED_BY(mutex_);
  std::shared_ptr<const std::string> text_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Instant> until_ BAUDGATE_GUARDED_BY(mutex_);  // of the trial
};

// The configuration file of the user, which is only read. No caller waits long for its disk.

/// All is called on one thread, or while it does not run: that of `loop`.
class ConfigFile {
 public:
  using Text = Result<std::string>;

  /// `read`: on a thread of its own.
  ConfigFile(asio::io_context& loop, std::function<Text()> read, Duration patience)
      : loop_(loop), read_(std::move(read)), calls_("configuration", patience) {}

  Text Read();
  /// `seen` gets the text, later or at once.
  void Look(std::function<void(const Text& text)> seen);
  /// As long as the disk takes. Idempotent.
  void Stop() { calls_.Stop(); }

 private:
  asio::io_context& loop_;
  const std::function<Text()> read_;
  records::DiskCalls calls_;
};

// The copies of the configuration in the state folder, as the next start needs them. No caller
// waits long for the disk: a write that comes too late is corrected at the next look.

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
  records::DiskCalls calls_;
};

class Reloader final : public control::ReloadService {
 public:
  /// A configuration before it is applied. If it is dropped without `apply`, nothing has changed.
  struct Prepared {
    /// What cannot be opened: "listener 0.0.0.0:502: address already in use; …".
    std::vector<std::string> troubles;
    /// Applies the rest anyway, and the missing part as soon as it can; returns what is missing.
    std::function<std::vector<std::string>()> apply;
  };
  /// How it is done; on the reloader's thread.
  struct Links {
    std::function<std::shared_ptr<const config::Config>()> running;
    /// Whether the gateway keeps anything. Else the state folder is made at the first reload.
    std::function<bool()> keeps;
    std::function<Status()> open_folder;
    /// Adds what only a restart can change.
    std::function<void(const config::Config& next, reload::Difference& difference)> examine;
    /// Opens what is new.
    std::function<Prepared(config::Config next, const reload::Difference& difference)> prepare;
    std::function<reload::Healths()> healths;
    /// An event of the gateway's own.
    std::function<void(bool taken_back, const std::string& text)> tell;
  };
  Reloader(ReloadOptions options, Links links);
  ~Reloader() override { Stop(); }

  /// Keeps what runs.
  void Start();
  /// Ends what is under way; nothing is answered after it. Idempotent.
  void Stop();

  // From any thread.
  void Reload(const control::ReloadAsk& ask, Answered answered) override;
  void Confirm(const std::string& by, Answered answered) override;
  status::ReloadState state() const { return display_.StateAt(ReadClocks()); }
  /// The text that runs, without its secrets.
  Result<std::string> ConfigurationText() const;

 private:
  static constexpr Duration kLook = reload::Trial::kShortest;
  static constexpr Duration kLookAtFile = 5s;

  control::ReloadAnswer Do(const control::ReloadAsk& ask);
  control::ReloadAnswer Take(const control::ReloadAsk& ask, const std::string& text,
                             config::Config next);
  control::ReloadAnswer Apply(const control::ReloadAsk& ask, const std::string& text,
                              config::Config next, const reload::Difference& difference);
  control::ReloadAnswer Unchanged(const control::ReloadAsk& ask, const std::string& text);
  control::ReloadAnswer Done(const control::ReloadAsk& ask, const reload::Difference& difference,
                             const std::string& but);
  Duration TimeFor(const control::ReloadAsk& ask, const config::Config& next) const;
  void BeginTrial(Duration time, const reload::Healths& before);
  void FollowTrial();
  std::string OnTrial() const;
  control::ReloadAnswer DoConfirm(const std::string& by);
  void WatchTrial();
  void WatchFiles();
  void OnFile(const Result<std::string>& text);
  void TakeBack(const std::string& why);
  void ShowApplied();

  ReloadOptions options_;
  const Links links_;
  transports::LoopThread loop_{"reload"};
  ConfigFile file_;
  ConfigCopies copies_;
  asio::steady_timer timer_{loop_.io()};
  asio::steady_timer file_timer_{loop_.io()};
  reload::Trial trial_;
  bool started_ = false;
  ReloadDisplay display_;
};

}  // namespace baudgate::daemon
