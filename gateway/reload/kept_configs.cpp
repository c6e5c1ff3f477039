// SPDX-License-Identifier: Apache-2.0
#include "gateway/reload/kept_configs.h"

#include <system_error>

#include "gateway/base/system_trouble.h"
#include "gateway/state/whole_file.h"

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

/// Whoever has emptied or damaged the copy has confirmed nothing.
bool KeptConfigs::IsUnconfirmed(const std::string& text) const {
  if (!IsThere(trial_file())) return false;
  const auto on_trial = ReadWhole(trial_file());
  if (on_trial && !on_trial->empty()) return *on_trial == text;
  const auto good = confirmed();
  return good && *good != text;
}

// The order of the steps counts: the power may fail behind each.
Status KeptConfigs::Add(const std::string& text, bool trial) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return Error{folder_.string() + ": " + error.message()};
  const auto forget = [](const fs::path& file) { return StatusOf(file, RemoveFile(file)); };
  const fs::path file = trial ? trial_file() : confirmed_file();
  Status status = trial ? forget(why_file()) : Status();
  if (status) status = StatusOf(file, WriteWhole(file, text));
  if (status && !trial) status = forget(trial_file());
  if (status && !trial) status = forget(why_file());
  return status;
}

Result<bool> KeptConfigs::Restore(const std::string& text) {
  if (confirmed() == text) return false;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return Error{folder_.string() + ": " + error.message()};
  const Status status = StatusOf(confirmed_file(), WriteWhole(confirmed_file(), text));
  if (!status) return Error{status.error()};
  return true;
}

Status KeptConfigs::Confirm() {
  if (trial() != Trial::running) return {};
  return StatusOf(confirmed_file(), MoveFile(trial_file(), confirmed_file()));
}

Status KeptConfigs::TakeBack(const std::string& why) {
  if (trial() != Trial::running) return {};
  return StatusOf(why_file(), WriteWhole(why_file(), why));
}

}  // namespace baudgate::reload
