// The configuration that was confirmed last, and the one that is on trial or was taken back, as
// texts in the state folder. From these it is decided at a start what is loaded. Everything is on
// the disk before it holds.
//
//   STATE/configurations/confirmed.yaml   as the file was
//   STATE/configurations/trial.yaml       as the file was; only while it is on trial or taken back
//   STATE/configurations/taken_back.txt   why; only where it was taken back
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "gateway/base/result.h"

namespace baudgate::reload {

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
  /// Nothing: there is none, or it cannot be read.
  std::optional<std::string> confirmed() const;
  Trial trial() const;
  /// At a start also of a trial that still runs there: the gateway ended before its end.
  std::string why_taken_back() const;
  /// This very text is on trial, or was taken back: a start runs what was confirmed in its place.
  /// If the copy of the trial is empty or cannot be read, that is any text but the confirmed one.
  bool IsUnconfirmed(const std::string& text) const;

  /// It is about to be applied: for good, or for a trial.
  Status Add(const std::string& text, bool trial);
  /// Somebody has removed or changed the copy of what was confirmed: it is written again. Else
  /// nothing is done. `text`: what it has to be. Whether it had to be written.
  Result<bool> Restore(const std::string& text);
  /// What is on trial stays.
  Status Confirm();
  /// What is on trial is not wanted.
  Status TakeBack(const std::string& why);

 private:
  std::filesystem::path trial_file() const { return folder_ / "trial.yaml"; }
  std::filesystem::path why_file() const { return folder_ / "taken_back.txt"; }

  const std::filesystem::path folder_;
};

}  // namespace baudgate::reload
