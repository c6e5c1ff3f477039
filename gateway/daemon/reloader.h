// Applies a changed configuration file while the gateway runs, on request (SIGHUP, `baudgate
// reload`); an edit alone is only shown in the status. Reads the file, says what it changes, has it
// applied, keeps a copy, and takes it back if it is not confirmed. On a thread of its own; lines,
// outputs and the watchdog do not wait for it, and it does not wait for a disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/control/reload_requests.h"
#include "gateway/daemon/config_copies.h"
#include "gateway/daemon/reload_display.h"
#include "gateway/reload/difference.h"
#include "gateway/reload/kept_configs.h"
#include "gateway/reload/probation.h"
#include "gateway/state/disk_calls.h"
#include "transports/loop_thread.h"

namespace baudgate {

/// A text as a configuration, or why it is invalid.
struct LoadedText {
  std::optional<config::Config> config;
  std::vector<std::string> problems;  ///< "…yaml:7:3: …"; only warnings if there is a configuration
};

/// A text that was on trial and given up.
struct Refused {
  std::string text;
  std::string why;
};

/// The sentence of a configuration that was given up, for log, event and status.
std::string TakenBack(const std::string& file, const std::string& why);

/// What a program that starts a gateway from a file provides.
struct ReloadOptions {
  std::string file;
  std::function<Result<std::string>()> read;                ///< the file, as it is now
  std::function<LoadedText(const std::string& text)> load;  ///< paths in it are the file's
  std::function<void(const std::string& state)> notify;     ///< as sd_notify
  std::function<std::string()> summary;                     ///< what runs, for READY=1
  /// A text without its secrets; empty: they cannot be found.
  std::function<Result<std::string>(const std::string& text)> masked{};
  std::string text_at_start;                ///< the text that runs
  std::optional<Refused> refused;           ///< the text of the file, if it was taken back
  std::optional<reload::KeptConfigs> kept;  ///< empty: there is no folder
  Duration disk_patience = 5s;              ///< how long an answer waits for a file
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
  control::ReloadState state() const { return display_.StateAt(ReadClocks()); }
  /// The text that runs, without its secrets.
  Result<std::string> ConfigurationText() const;

 private:
  static constexpr Duration kLook = 250ms;
  static constexpr Duration kLookAtFile = 5s;

  /// A text that was applied, and what it and the profiles said then.
  struct Applied {
    std::string text;
    std::shared_ptr<const config::Config> config;
  };

  control::ReloadAnswer Do(const control::ReloadAsk& ask);
  control::ReloadAnswer Take(const control::ReloadAsk& ask, const std::string& text,
                             config::Config next);
  control::ReloadAnswer Apply(const control::ReloadAsk& ask, const std::string& text,
                              config::Config next, const reload::Difference& difference);
  bool IsRefused(const std::string& text) const;
  control::ReloadAnswer Unchanged(const control::ReloadAsk& ask, const std::string& text);
  control::ReloadAnswer Done(const control::ReloadAsk& ask, const reload::Difference& difference,
                             const std::string& but);
  Duration TrialOf(const control::ReloadAsk& ask, const config::Config& next) const;
  void BeginTrial(Duration time, const reload::Healths& before);
  Duration Left() const;
  std::string OnTrial() const;
  control::ReloadAnswer DoConfirm(const std::string& by);
  void Watch();
  void WatchFiles();
  void LookAtFile();
  void OnFile(const Result<std::string>& text);
  void TakeBack(const std::string& why);
  reload::KeptTexts ToKeep() const;
  reload::KeptTexts Next(const std::string& text, Duration trial) const;
  void SetApplied(std::shared_ptr<const Applied> runs);

  ReloadOptions options_;
  const Links links_;
  DiskCalls file_calls_;  // of the configuration file
  LoopThread loop_{"reload"};
  ConfigCopies copies_;
  asio::steady_timer timer_{loop_.io()};
  asio::steady_timer file_timer_{loop_.io()};
  reload::Probation probation_;
  std::shared_ptr<const Applied> applied_;    // see SetApplied
  std::shared_ptr<const Applied> confirmed_;  // another than `applied_` during a trial
  std::optional<Refused> refused_;            // the text of the file, if it was taken back
  bool started_ = false;
  ReloadDisplay display_;
};

}  // namespace baudgate
