// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "gateway/base/system_trouble.h"
#include "gateway/base/time.h"
#include "gateway/base/whole_file.h"
#include "gateway/daemon/reload/difference.h"

namespace baudgate::reload {

namespace {

namespace fs = std::filesystem;

bool IsThere(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

Status StatusOf(const fs::path& file, int failed) {
  return failed == 0 ? Status() : Error{file.string() + ": " + SystemTrouble(failed)};
}

}  // namespace

bool KeptConfigs::empty() const { return !IsThere(confirmed_file()) && !IsThere(trial_file()); }

std::optional<std::string> KeptConfigs::confirmed() const { return ReadWhole(confirmed_file()); }

KeptConfigs::Trial KeptConfigs::trial() const {
  if (!IsThere(trial_file())) return Trial::none;
  return IsThere(why_file()) ? Trial::taken_back : Trial::running;
}

std::string KeptConfigs::why_taken_back() const {
  if (trial() == Trial::running) return "the gateway ended before the configuration was confirmed";
  return ReadWhole(why_file()).value_or(std::string());
}

bool KeptConfigs::IsUnconfirmed(const std::string& text) const {
  if (!IsThere(trial_file())) return false;
  const auto on_trial = ReadWhole(trial_file());
  if (on_trial && !on_trial->empty()) return *on_trial == text;
  const auto good = confirmed();
  return good && !good->empty() && *good != text;
}

// The power can fail after each step, so the order matters: a text must never be stored beside the
// reason of another text, and a confirmed trial must never be lost.
Result<bool> KeptConfigs::Write(const KeptTexts& wanted) const {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return Error{folder_.string() + ": " + error.message()};
  bool differed = false;
  Status status;
  const auto set = [&](const fs::path& file, const std::optional<std::string>& text) {
    const bool right = text ? ReadWhole(file) == text : !IsThere(file);
    if (!status || right) return;
    differed = true;
    status = StatusOf(file, text ? WriteWhole(file, *text) : RemoveFile(file));
  };
  const auto on_trial = ReadWhole(trial_file());
  if (on_trial == wanted.confirmed && !wanted.trial && trial() == Trial::running) {
    differed = true;
    status = StatusOf(confirmed_file(), MoveFile(trial_file(), confirmed_file()));
  }
  set(confirmed_file(), wanted.confirmed);
  if (on_trial != wanted.trial || !wanted.why) set(why_file(), std::nullopt);
  set(trial_file(), wanted.trial);
  set(why_file(), wanted.why);
  if (!status) return Error{status.error()};
  return differed;
}

void Probation::Begin(Instant now, Duration time, const Healths& before) {
  until_ = now + time;
  patience_ = std::min(kTimeToAnswer, time / 2);
  for (const auto& [device, health] : before) {
    if (health == Health::well) well_.try_emplace(device);
  }
  for (auto& [device, seen] : well_) seen = now;
}

void Probation::End() {
  until_.reset();
  well_.clear();
}

std::optional<std::string> Probation::Look(Instant now, const Healths& healths) {
  if (!until_) return std::nullopt;
  for (auto& [device, seen] : well_) {
    const auto found = healths.find(device);
    if (found == healths.end()) continue;
    if (found->second == Health::ill) return device + " worked before the change, and fails now";
    if (found->second != Health::unknown) {
      seen = now;
    } else if (now >= seen + patience_) {
      return device + " worked before the change, and has not answered since";
    }
  }
  if (now < *until_) return std::nullopt;
  return "nobody ran 'baudgate confirm' in time";
}

std::string TakenBack(const std::string& file, const std::string& why) {
  return fmt::format(
      "{} is not in use: {}. The gateway runs the last confirmed configuration, also after a "
      "restart, until you change the file",
      file, why);
}

void Trial::Start(Applied runs) {
  Apply(std::move(runs));
  confirmed_ = applied_;
}

std::optional<Instant> Trial::until() const {
  return running() ? std::optional(probation_.until()) : std::nullopt;
}

Duration Trial::Left(Instant now) const {
  if (!running()) return Duration::zero();
  return std::chrono::ceil<std::chrono::seconds>(probation_.until() - now);
}

Duration Trial::TimeFor(const config::Config& next, Duration asked, Instant now) const {
  if (!running()) return asked;
  if (Compare(*confirmed_->config, next).empty()) return Duration::zero();
  if (asked > Duration::zero()) return asked;
  return std::max<Duration>(probation_.until() - now, kShortest);
}

void Trial::Begin(Duration time, const Healths& before, Instant now) {
  if (time > Duration::zero()) {
    probation_.Begin(now, time, before);
  } else {
    probation_.End();
    confirmed_ = applied_;
  }
  refused_.reset();
}

std::optional<std::string> Trial::Look(const Healths& healths, Instant now) {
  return probation_.Look(now, healths);
}

void Trial::TakeBack(const std::string& why) {
  refused_ = {applied_->text, why};
  probation_.End();
  applied_ = confirmed_;
}

KeptTexts Trial::ToKeep() const {
  if (running()) return {confirmed_->text, applied_->text};
  if (refused_) return {confirmed_->text, refused_->text, refused_->why};
  return {confirmed_->text};
}

KeptTexts Trial::ToKeepWith(const std::string& text, Duration time) const {
  if (time > Duration::zero()) return {confirmed_->text, text};
  return {text};
}

}  // namespace baudgate::reload
