// The way of values from the point store to the files of the history. Made and ended by daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "config/model/config.h"
#include "gateway/records/history/history_log.h"

namespace baudgate {

struct HistoryPlace {
  std::filesystem::path folder{};  ///< empty: there is no place for it
  std::string why_no_folder{};
  // As in HistoryLog.
  std::function<Status()> ready{};
  std::function<bool()> taken{};
};

/// Before the lines start. `config` and `store` outlive it.
std::unique_ptr<history::HistoryLog> MakeHistory(const config::Config& config, PointStore& store,
                                                 HistoryPlace place);

}  // namespace baudgate
