// `Reloader` applies a changed configuration file while the gateway runs, on request (SIGHUP,
// `baudgate reload`); without a request, the status only shows that the file has changed. Reloader
// reads the file, reports the changes, has them applied, stores a copy, and takes the changes back
// if they are not confirmed. It runs on a separate thread: lines, outputs and the watchdog do not
// wait for it, and it does not wait long for a disk. `ReloadDisplay` shows the current
// configuration, `ConfigFile` reads the user's file, and `ConfigCopies` stores copies.
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

/// The configuration of a text, or why the text is invalid.
struct LoadedText {
  std::optional<config::Config> config;
  std::vector<std::string> problems;  ///< "…yaml:7:3: …"; only warnings if `config` is set
};

struct ReloadOptions {
  std::string file;
  std::function<Result<std::string>()> read;
  /// Parses a text. Paths in the text are relative to the file.
  std::function<LoadedText(const std::string& text)> load;
  /// Sends a state to systemd, as sd_notify does.
  std::function<void(const std::string& state)> notify;
  std::function<std::string()> summary;  ///< describes what runs, for READY=1
  /// Returns a text without its secrets, or an error if the secrets cannot be found in the text.
  std::function<Result<std::string>(const std::string& text)> masked{};
  std::string text_at_start;
  /// The text of the file, if it was taken back before this start.
  std::optional<reload::Refused> refused;
  std::optional<reload::KeptConfigs> kept;  ///< nothing: there is no state folder
  Duration disk_patience = 5s;              ///< the longest time that a request waits for the disk
};

// ReloadDisplay contains the current configuration as outputs show it: its state, its text, and the
// end of its trial. The reloader's thread writes it; any thread can read it.
class ReloadDisplay {
 public:
  void Change(const std::function<void(status::ReloadState&)>& change) {
    const MutexLock lock(mutex_);
    change(state_);
  }
  /// Sets the text that runs from now on; the text contains its secrets.
  void SetText(std::shared_ptr<const std::string> text) {
    const MutexLock lock(mutex_);
    text_ = std::move(text);
  }
  /// Notes that the configuration of the file runs, on trial until `until`; nothing: permanently.
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
  /// Returns null before Start.
  std::shared_ptr<const std::string> text() const {
    const MutexLock lock(mutex_);
    return text_;
  }

 private:
  mutable Mutex mutex_;
  status::ReloadState state_ BAUDGATE_GUARDED_BY(mutex_);
  std::shared_ptr<const std::string> text_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Instant> until_ BAUDGATE_GUARDED_BY(mutex_);
};

/// ConfigFile reads the user's configuration file, and never writes it. No caller waits longer than
/// `patience`. All calls must come from the thread of `loop`, or while the loop does not run.
class ConfigFile {
 public:
  using Text = Result<std::string>;

  /// `read` is called on a separate thread.
  ConfigFile(asio::io_context& loop, std::function<Text()> read, Duration patience)
      : loop_(loop), read_(std::move(read)), calls_("configuration", patience) {}

  Text Read();
  /// Reads the file in the background. `seen` gets the text later on the loop, or an error at once.
  void Look(std::function<void(const Text& text)> seen);
  /// Waits until a running call of the disk has returned. Idempotent.
  void Stop() { calls_.Stop(); }

 private:
  asio::io_context& loop_;
  const std::function<Text()> read_;
  records::DiskCalls calls_;
};

/// ConfigCopies stores the copies of the configuration in the state folder, as the next start needs
/// them. No caller waits longer than `patience`; the next Look corrects a write that came too late.
/// All calls must come from the thread of `loop`, or while the loop does not run.
class ConfigCopies {
 public:
  /// `kept`: nothing if there is no folder. `open_folder` creates and locks the folder.
  ConfigCopies(asio::io_context& loop, std::optional<reload::KeptConfigs> kept, Duration patience,
               std::function<Status()> open_folder);

  bool found() const { return kept_ && !kept_->empty(); }
  std::string folder() const { return kept_ ? kept_->folder().string() : std::string(); }

  /// Opens the folder, unless it is open, and writes `texts`.
  Status Keep(const reload::KeptTexts& texts);
  /// Writes the copies that differ from `texts`, if the folder is open: a copy may have been
  /// removed or changed, or a full disk may have room again. `seen` gets nothing if the copies are
  /// up to date, else the reason why they cannot be written; it is called on the loop, or at once.
  void Look(const reload::KeptTexts& texts,
            std::function<void(std::optional<std::string> trouble)> seen);
  /// Waits until a running call of the disk has returned. Idempotent.
  void Stop() { calls_.Stop(); }

 private:
  Status Open();
  std::optional<std::string> Trouble(const Result<bool>& written);

  asio::io_context& loop_;
  const std::optional<reload::KeptConfigs> kept_;
  const std::function<Status()> open_folder_;
  bool open_ = false;  // this process has opened and locked the folder
  std::optional<std::string> trouble_;
  records::DiskCalls calls_;
};

class Reloader final : public control::ReloadService {
 public:
  /// A configuration before it is applied. If it is destroyed without a call of `apply`, the
  /// gateway is unchanged.
  struct Prepared {
    /// A text for each port and file that cannot be opened: "listener 0.0.0.0:502: address already
    /// in use".
    std::vector<std::string> troubles;
    /// Applies the configuration even if a part fails. The gateway tries such a part again until it
    /// works. Returns the failed parts.
    std::function<std::vector<std::string>()> apply;
  };
  /// Functions of the gateway that the reloader calls on its thread.
  struct Links {
    std::function<std::shared_ptr<const config::Config>()> running;
    /// Returns whether the gateway stores anything on the disk. If not, the state folder is created
    /// at the first reload.
    std::function<bool()> keeps;
    std::function<Status()> open_folder;
    /// Adds to `difference` what only the outputs and records know: further changed settings,
    /// changes that need a restart, and the clients of each listener.
    std::function<void(const config::Config& next, reload::Difference& difference)> examine;
    /// Opens the ports that `next` needs in addition to the open ports, and starts its threads.
    std::function<Prepared(config::Config next, const reload::Difference& difference)> prepare;
    std::function<reload::Healths()> healths;
    std::function<void(bool taken_back, const std::string& text)> tell;
  };
  Reloader(ReloadOptions options, Links links);
  ~Reloader() override { Stop(); }

  /// Starts the thread. Also stores a copy of the current configuration, if the gateway stores
  /// anything, or has stored a copy before.
  void Start();
  /// Ends the current work. Later requests are not answered. Idempotent.
  void Stop();

  // Reload, Confirm, Revert and state are thread-safe.
  void Reload(const control::ReloadAsk& ask, Answered answered) override;
  void Confirm(const control::ReloadAsk& ask, Answered answered) override;
  void Revert(const control::ReloadAsk& ask, Answered answered) override;
  status::ReloadState state() const { return display_.StateAt(ReadClocks()); }
  /// Returns the text that runs, without its secrets.
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
  control::ReloadAnswer DoConfirm(const control::ReloadAsk& ask);
  control::ReloadAnswer DoRevert(const control::ReloadAsk& ask);
  /// Returns the answer if the configuration that `ask` means is not on trial.
  std::optional<control::ReloadAnswer> NoTrial(const control::ReloadAsk& ask) const;
  void WatchTrial();
  void WatchFiles();
  void OnFile(const Result<std::string>& text);
  /// Applies the confirmed configuration again. Returns a sentence that says so.
  std::string TakeBack(const std::string& why);
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
