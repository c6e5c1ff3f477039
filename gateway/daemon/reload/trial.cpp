// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/daemon/reload/difference.h"

namespace baudgate::reload {

std::string TakenBack(const std::string& file, const std::string& why) {
  return fmt::format(
      "{} was taken back: {}; the confirmed configuration runs, now and at every start until the "
      "file is changed",
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
