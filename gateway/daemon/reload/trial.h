// `Trial` tracks which text of the configuration runs, which text was confirmed and which was
// refused, and how long a text is on trial. Time and health of devices are arguments; there is no
// I/O.
//
//   applied   confirmed   refused
//   a         a           –          a runs permanently
//   b         a           –          b is on trial
//   a         a           b          b was taken back
//
// `KeptConfigs` stores the texts in the state folder, and `Probation` decides whether a text stays.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::reload {

// KeptConfigs stores texts of the configuration in the state folder: the text that was confirmed
// last, and the text that is on trial or was taken back. A start decides by them what to load.
// Every change is written to the disk before it takes effect.
//
//   STATE/configurations/confirmed.yaml   the confirmed file
//   STATE/configurations/trial.yaml       the file that is on trial or was taken back
//   STATE/configurations/taken_back.txt   exists only if trial.yaml was taken back: why
//

/// The texts that the next start must find in the folder.
struct KeptTexts {
  std::string confirmed;
  std::optional<std::string> trial{};  ///< the text that is on trial, or was taken back
  std::optional<std::string> why{};    ///< why `trial` was taken back; nothing if it was not
};

class KeptConfigs {
 public:
  enum class Trial : std::uint8_t { none, running, taken_back };
  static constexpr const char* kFolder = "configurations";

  /// `folder` is created with the first configuration.
  explicit KeptConfigs(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path confirmed_file() const { return folder_ / "confirmed.yaml"; }
  bool empty() const;
  /// Returns nothing if there is no confirmed text, or if it cannot be read.
  std::optional<std::string> confirmed() const;
  Trial trial() const;
  /// Returns why the trial was taken back. At a start, a trial that is still running in the folder
  /// counts as taken back, because the gateway ended before the end of the trial.
  std::string why_taken_back() const;
  /// True if `text` is on trial, or was taken back: a start then loads the confirmed text instead.
  /// If the copy of the trial is empty or cannot be read, every text except the confirmed text is
  /// unconfirmed; if neither copy can be used, no text is.
  bool IsUnconfirmed(const std::string& text) const;

  /// Writes the texts that differ in the folder, and removes files that are not in `wanted`.
  /// Returns whether anything differed.
  Result<bool> Write(const KeptTexts& wanted) const;

 private:
  std::filesystem::path trial_file() const { return folder_ / "trial.yaml"; }
  std::filesystem::path why_file() const { return folder_ / "taken_back.txt"; }

  const std::filesystem::path folder_;
};

// `Probation` decides by the health of the devices whether a configuration on trial stays. It is
// taken back when the time is over without a confirmation, or at once when a device that was well
// before is no longer well.
//
//   Begin(0 s, 60 s, {bay-1.a})
//   Look(5 s, a well)       nothing
//   Look(5 s, a offline)    "bay-1.a worked before the change, and fails now"
//   Look(60 s)              "nobody has confirmed it in time"
enum class Health : std::uint8_t {
  well,     ///< the device answers, and is the right device
  unknown,  ///< the device has not been asked long enough since the port was opened or came back
  ill,      ///< the device does not answer, or is another device
  unasked,  ///< the device is out of use, or its port is lent, so its health does not matter
};

/// Key: "bay-1.feeder-1". Devices that no longer exist are missing.
using Healths = std::map<std::string, Health>;

class Probation {
 public:
  /// A device whose health is unknown for this time, or for half of the trial if this is shorter,
  /// counts as ill.
  static constexpr Duration kTimeToAnswer = 20s;

  /// Starts a trial, in place of a running trial. Devices that were well before the replaced trial
  /// still count as well before.
  void Begin(Instant now, Duration time, const Healths& before);
  bool running() const { return until_.has_value(); }
  Instant until() const { return until_.value_or(Instant::max()); }
  /// Returns why the configuration must be taken back; nothing if the trial continues, or no trial
  /// runs.
  std::optional<std::string> Look(Instant now, const Healths& healths);
  void End();

 private:
  std::optional<Instant> until_;
  Duration patience_{};
  /// For each device that was well before: when its health was last known. Empty while no trial
  /// runs.
  std::map<std::string, Instant> well_;
};

/// A text that was applied, and the configuration that was loaded from it, with its profiles.
struct Applied {
  std::string text;
  std::shared_ptr<const config::Config> config;
};

struct Refused {
  std::string text;
  std::string why;
};

/// Returns the sentence for log, event and status when a configuration was taken back.
std::string TakenBack(const std::string& file, const std::string& why);

class Trial {
 public:
  static constexpr Duration kShortest = 250ms;

  /// `refused` is the text of the file and the reason, if it was taken back before the start.
  explicit Trial(std::optional<Refused> refused) : refused_(std::move(refused)) {}
  /// Must be called at the start: `runs` is applied and confirmed.
  void Start(Applied runs);

  /// Not null after Start.
  const std::shared_ptr<const Applied>& applied() const { return applied_; }
  const Applied& confirmed() const { return *confirmed_; }
  const std::optional<Refused>& refused() const { return refused_; }
  bool IsRefused(const std::string& text) const { return refused_ && refused_->text == text; }
  bool running() const { return probation_.running(); }
  std::optional<Instant> until() const;
  /// Returns the rest of the trial, rounded up to seconds; zero if no trial runs.
  Duration Left(Instant now) const;

  /// Returns how long `next` must be on trial; zero: it is confirmed at once. `asked` is the time
  /// that the user wants; zero: no trial. While a trial runs, zero means the rest of the trial, so
  /// that a reload cannot end a trial; only the confirmed configuration is then confirmed at once.
  Duration TimeFor(const config::Config& next, Duration asked, Instant now) const;
  /// Notes that the text of `runs` is applied. Begin must follow.
  void Apply(Applied runs) { applied_ = std::make_shared<const Applied>(std::move(runs)); }
  /// Starts a trial of the applied text. If `time` is zero, ends the running trial and confirms the
  /// applied text.
  void Begin(Duration time, const Healths& before, Instant now);
  /// Returns why the applied text must be taken back; nothing if the trial continues, or no trial
  /// runs.
  std::optional<std::string> Look(const Healths& healths, Instant now);
  /// Notes that the confirmed text runs again.
  void TakeBack(const std::string& why);

  /// Returns the texts that a start must find in the state folder now.
  KeptTexts ToKeep() const;
  /// Returns the texts that a start must find in the state folder once `text` is applied, with a
  /// trial of `time`.
  KeptTexts ToKeepWith(const std::string& text, Duration time) const;

 private:
  Probation probation_;
  std::shared_ptr<const Applied> applied_;
  std::shared_ptr<const Applied> confirmed_;  // differs from `applied_` during a trial
  std::optional<Refused> refused_;
};

}  // namespace baudgate::reload
