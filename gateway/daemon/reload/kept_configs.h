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

}  // namespace baudgate::reload
