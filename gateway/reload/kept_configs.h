// The configurations that were applied, as texts in the state folder: the last twenty, which of
// them is confirmed, which is on trial, and which was refused. From these it is decided at a start
// what is loaded. Everything is on the disk before it holds.
//
//   STATE/configurations/000007.yaml   as the file was
//   STATE/configurations/index.json    {"entries":[{"number":7,"time_ms":…,"by":"user:anna"}],
//                                       "confirmed":7,"trial":null,"refused":null}
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::reload {

struct KeptEntry {
  std::uint64_t number = 0;  ///< from 1 on
  WallTime time{};
  std::string by;  ///< "start", "SIGHUP", "user:anna"
};

class KeptConfigs {
 public:
  static constexpr std::size_t kMost = 20;
  static constexpr const char* kFolder = "configurations";

  /// Reads what is there. `folder` is made with the first entry.
  explicit KeptConfigs(std::filesystem::path folder);

  const std::filesystem::path& folder() const { return folder_; }
  /// Why what was applied before is not known; empty: it is, or there was nothing.
  const std::string& trouble() const { return trouble_; }
  /// Oldest first.
  const std::vector<KeptEntry>& entries() const { return index_.entries; }
  /// 0: none.
  std::uint64_t confirmed() const { return index_.confirmed; }
  std::uint64_t trial() const { return index_.trial ? index_.trial->number : 0; }
  std::uint64_t refused() const { return index_.refused ? index_.refused->number : 0; }
  std::string why_refused() const { return index_.refused ? index_.refused->why : std::string(); }
  std::filesystem::path PathOf(std::uint64_t number) const;
  Result<std::string> TextOf(std::uint64_t number) const;
  /// Nothing: there is none, or it can not be read.
  std::optional<std::string> confirmed_text() const;

  /// What a start takes. Nothing: the file. Else the confirmed copy, because this very text was
  /// refused, or its trial has not ended.
  std::optional<std::uint64_t> CopyInPlaceOf(const std::string& text) const;

  /// It is about to be applied: for good, or for a trial.
  Status Add(const std::string& text, std::string by, WallTime now, bool trial);
  /// What is on trial stays.
  Status Confirm();
  /// What is on trial is not wanted.
  Status Refuse(std::string why, WallTime now);

 private:
  struct Trial {
    std::uint64_t number = 0;
  };
  struct Refused {
    std::uint64_t number = 0;
    std::string why;
    WallTime time{};
  };
  struct Index {
    std::vector<KeptEntry> entries;
    std::uint64_t confirmed = 0;
    std::optional<Trial> trial;
    std::optional<Refused> refused;
  };

  void Read();
  Status Write(const Index& index);
  void Drop(Index& index) const;
  const std::filesystem::path folder_;
  std::string trouble_;
  Index index_;
};

}  // namespace baudgate::reload
