// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/kept_configs.h"

#include <system_error>

#include "gateway/base/system_trouble.h"
#include "gateway/base/whole_file.h"

namespace baudgate::reload {
namespace {

namespace fs = std::filesystem;

bool IsThere(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

/// `failed`: errno's; 0: it did not.
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
  if (trial() == Trial::running) return "the gateway ended before it was confirmed";
  return ReadWhole(why_file()).value_or(std::string());
}

/// An empty or damaged copy confirms nothing.
bool KeptConfigs::IsUnconfirmed(const std::string& text) const {
  if (!IsThere(trial_file())) return false;
  const auto on_trial = ReadWhole(trial_file());
  if (on_trial && !on_trial->empty()) return *on_trial == text;
  const auto good = confirmed();
  return good && *good != text;
}

// The power may fail after each step. A text is never beside the reason of another one, and a
// trial that is confirmed is never gone.
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

}  // namespace baudgate::reload
