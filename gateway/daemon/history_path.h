// The way of values from the point store to the files of the history. Made and ended by daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "config/model/config.h"
#include "gateway/history/history_log.h"

namespace baudgate {

/// Before the lines start. `folder` empty: `why_no_folder`. `config` and `store` outlive it.
std::unique_ptr<history::HistoryLog> MakeHistory(const config::Config& config, PointStore& store,
                                                 std::filesystem::path folder,
                                                 std::string why_no_folder);

}  // namespace baudgate
