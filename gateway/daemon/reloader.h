// Applies a changed configuration file while the gateway runs, on request (SIGHUP, `baudgate
// reload`); an edit alone is only shown in the status. Reads the file, says what it changes, has it
// applied, keeps a copy, and takes it back if it is not confirmed. On a thread of its own; lines,
// outputs and the watchdog do not wait for it, and it does not wait for a disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/daemon/config_copies.h"
#include "gateway/daemon/config_file.h"
#include "gateway/daemon/reload/difference.h"
#include "gateway/daemon/reload/trial.h"
#include "gateway/daemon/reload_display.h"
#include "gateway/daemon/reload_options.h"
#include "gateway/outputs/control/reload_requests.h"
#include "transports/loop_thread.h"

namespace baudgate {

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
  control::ReloadState state() const { return display_.StateAt(ReadClocks()); }
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
  LoopThread loop_{"reload"};
  ConfigFile file_;
  ConfigCopies copies_;
  asio::steady_timer timer_{loop_.io()};
  asio::steady_timer file_timer_{loop_.io()};
  reload::Trial trial_;
  bool started_ = false;
  ReloadDisplay display_;
};

}  // namespace baudgate
