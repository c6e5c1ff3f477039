// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/history_path.h"

#include <utility>

#include "gateway/base/log.h"

namespace baudgate {

std::unique_ptr<history::HistoryLog> MakeHistory(const config::Config& config, PointStore& store,
                                                 HistoryPlace place) {
  history::HistoryLog::Options options;
  options.config = &config;
  options.store = &store;
  options.folder = std::move(place.folder);
  options.why_no_folder = std::move(place.why_no_folder);
  options.ready = std::move(place.ready);
  options.taken = std::move(place.taken);
  options.clocks = ReadClocks;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  return std::make_unique<history::HistoryLog>(std::move(options));
}

}  // namespace baudgate
