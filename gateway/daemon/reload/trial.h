// Which text of the configuration runs, which one was confirmed, and which one was given up; and
// for how long a text is on trial. Pure: the time and the condition of devices are arguments.
//
//   applied   confirmed   refused
//   a         a           –          a runs for good
//   b         a           –          b is on trial
//   a         a           b          b was taken back
//
// KeptConfigs keeps the texts in the state folder, and Probation decides whether a text stays.
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

// The configuration that was confirmed last, and the one that is on trial or was taken back, as
// texts in the state folder. From these it is decided at a start what is loaded. Everything is on
// the disk before it holds.
//
//   STATE/configurations/confirmed.yaml   as the file was
//   STATE/configurations/trial.yaml       as the file was; only while it is on trial or taken back
//   STATE/configurations/taken_back.txt   why; only where it was taken back

/// What the folder has to say to the next start.
struct KeptTexts {
  std::string confirmed;
  std::optional<std::string> trial{};  ///< on trial, or taken back
  std::optional<std::string> why{};    ///< with `trial`: why it was taken back
};

class KeptConfigs {
 public:
  enum class Trial : std::uint8_t { none, running, taken_back };
  static constexpr const char* kFolder = "configurations";

  /// `folder` is made with the first configuration.
  explicit KeptConfigs(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path confirmed_file() const { return folder_ / "confirmed.yaml"; }
  /// Nothing was ever kept.
  bool empty() const;
  /// Empty: there is none, or it cannot be read.
  std::optional<std::string> confirmed() const;
  Trial trial() const;
  /// At a start also of a trial that still runs there: the gateway ended before its end.
  std::string why_taken_back() const;
  /// This very text is on trial, or was taken back: a start runs what was confirmed in its place.
  /// If the copy of the trial is empty or cannot be read, that is any text but the confirmed one.
  bool IsUnconfirmed(const std::string& text) const;

  /// Writes what differs in the folder, and removes what is not wanted. Returns whether anything
  /// differed.
  Result<bool> Write(const KeptTexts& wanted) const;

 private:
  std::filesystem::path trial_file() const { return folder_ / "trial.yaml"; }
  std::filesystem::path why_file() const { return folder_ / "taken_back.txt"; }

  const std::filesystem::path folder_;
};

// Whether a configuration that was applied for a trial stays: until it is confirmed in time, it is
// given up when the time is over, or at once when devices that were well before are not any more.
// Pure: no clock, no gateway.
//
//   Begin(0 s, 60 s, {bay-1.a})
//   Look(5 s, a well)       nothing
//   Look(5 s, a offline)    "bay-1.a worked before the change, and fails now"
//   Look(60 s)              "nobody has confirmed it in time"
enum class Health : std::uint8_t {
  well,     ///< it answers, and is what it should be
  unknown,  ///< it has not been asked long enough since the port was opened or came back
  ill,      ///< it does not answer, or is another one
  unasked,  ///< out of use, or its port is lent: nobody wants to know
};

/// "bay-1.feeder-1" → how it is. Devices that are not there are not asked for any more.
using Healths = std::map<std::string, Health>;

class Probation {
 public:
  /// A device of which nothing is known for this time is ill; half of the trial, if that is
  /// shorter.
  static constexpr Duration kTimeToAnswer = 20s;

  /// Also while one runs, which it takes the place of: what was well before that counts on.
  void Begin(Instant now, Duration time, const Healths& before);
  bool running() const { return until_.has_value(); }
  Instant until() const { return until_.value_or(Instant::max()); }
  /// Why it is to be given up; empty: it goes on, or none runs.
  std::optional<std::string> Look(Instant now, const Healths& healths);
  /// It has ended, either way.
  void End();

 private:
  std::optional<Instant> until_;
  Duration patience_{};
  /// What was well before: when it was last seen otherwise than unknown. Empty while none runs.
  std::map<std::string, Instant> well_;
};

/// A text that was applied, and what it and the profiles said then.
struct Applied {
  std::string text;
  std::shared_ptr<const config::Config> config;
};

/// A text that was on trial and given up.
struct Refused {
  std::string text;
  std::string why;
};

/// The sentence of a configuration that was given up, for log, event and status.
std::string TakenBack(const std::string& file, const std::string& why);

class Trial {
 public:
  /// No trial is shorter.
  static constexpr Duration kShortest = 250ms;

  /// `refused`: the text of the file, if it was taken back before the start.
  explicit Trial(std::optional<Refused> refused) : refused_(std::move(refused)) {}
  /// At the start: this text runs, and is confirmed.
  void Start(Applied runs);

  /// Not null from the start on.
  const std::shared_ptr<const Applied>& applied() const { return applied_; }
  const Applied& confirmed() const { return *confirmed_; }
  const std::optional<Refused>& refused() const { return refused_; }
  bool IsRefused(const std::string& text) const { return refused_ && refused_->text == text; }
  bool running() const { return probation_.running(); }
  /// Empty: no text is on trial.
  std::optional<Instant> until() const;
  /// The rest of the trial in whole seconds; zero: there is none.
  Duration Left(Instant now) const;

  /// How long `next` is to be on trial; zero: it is for good. `asked`: how long the user wants it;
  /// zero: no trial. A trial that runs does not end by that: then `next` has the rest of it. What
  /// was confirmed before needs no trial.
  Duration TimeFor(const config::Config& next, Duration asked, Instant now) const;
  /// Another text runs; then Begin.
  void Apply(Applied runs) { applied_ = std::make_shared<const Applied>(std::move(runs)); }
  /// A trial of what runs. Zero ends the one before and confirms what runs.
  void Begin(Duration time, const Healths& before, Instant now);
  /// Why what runs is to be given up; empty: the trial goes on, or none runs.
  std::optional<std::string> Look(const Healths& healths, Instant now);
  /// What was confirmed runs again.
  void TakeBack(const std::string& why);

  /// What a start has to find, as it is now.
  KeptTexts ToKeep() const;
  /// What a start has to find once `text` is applied.
  KeptTexts ToKeepWith(const std::string& text, Duration time) const;

 private:
  Probation probation_;
  std::shared_ptr<const Applied> applied_;
  std::shared_ptr<const Applied> confirmed_;  // another than `applied_` during a trial
  std::optional<Refused> refused_;
};

}  // namespace baudgate::reload
