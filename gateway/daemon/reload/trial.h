// Which text of the configuration runs, which one was confirmed, and which one was given up; and
// for how long a text is on trial. Pure: the time and the condition of devices are arguments.
//
//   applied   confirmed   refused
//   a         a           –          a runs for good
//   b         a           –          b is on trial
//   a         a           b          b was taken back
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/daemon/reload/kept_configs.h"
#include "gateway/daemon/reload/probation.h"

namespace baudgate::reload {

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
