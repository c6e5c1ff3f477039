// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check_kept.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/records/history/estimate.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

std::string Megabytes(std::uint64_t bytes) {
  return FormatNumber(std::round(static_cast<double>(bytes) / 1e5) / 10) + " MB";
}

}  // namespace

void PrintEvents(const config::Config& config, std::ostream& out) {
  std::string names = config.events.given ? "the gateway" : "";
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (!device.events && !device.point_events) continue;
      names += (names.empty() ? "" : ", ") + line.name + "." + device.name;
      if (!device.events) names += " (points)";
      bool first = true;
      for (const config::Record& record : device.records) {
        names += (std::exchange(first, false) ? " with " : " and ") + record.name;
      }
    }
  }
  if (names.empty()) return;
  const auto folder = EventsFolderOf(config);
  out << "events of " << names;
  if (!folder.empty()) out << ", and every write, in " << folder.string();
  out << '\n';
}

/// "load profiles of meters.m1 (1, 2), meters.m2 (1)": what meters keep themselves and is read
/// back.
void PrintOfMeters(const config::Config& config, std::ostream& out) {
  constexpr std::array<std::pair<const char*, const char*>, 2> kKinds = {
      {{"load_profile", "load profiles of "}, {"billing", "billing readings of "}}};
  for (const auto& [option, title] : kKinds) {
    std::string text;
    for (const config::Line& line : config.lines) {
      for (const config::Device& device : line.devices) {
        if (!device.options.Has(option) || device.options.Texts(option).empty()) continue;
        std::string words;
        for (const std::string& word : device.options.Texts(option)) {
          words += (words.empty() ? "" : ", ") + word;
        }
        text += (text.empty() ? title : ", ") + line.name + "." + device.name + " (" + words + ")";
      }
    }
    if (!text.empty()) out << text << '\n';
  }
}

void PrintHistory(const config::Config& config, std::ostream& out) {
  const config::History& history = config.history;
  if (!history.on()) return;
  const history::Estimate estimate = history::EstimateOf(config);
  const auto folder = HistoryFolderOf(config);
  const auto days = [&](std::uint64_t bytes) {
    return Plural(estimate.Days(history.limit, bytes), "day");
  };
  out << "history of " << Plural(history.points.size(), "point");
  if (!folder.empty()) out << " in " << folder.string();
  out << ": about " << Megabytes(estimate.least) << " a day while nothing changes, at most "
      << Megabytes(estimate.most) << ", and " << Megabytes(estimate.minutes)
      << " of minutes; the limit of " << Megabytes(history.limit) << " is reached after "
      << days(estimate.least) << ", or " << days(estimate.most) << " if every reading differs; "
      << "days older than " << FormatDuration(history.keep) << " go\n";
}

Json HistoryJson(const config::Config& config) {
  if (!config.history.on()) return {};
  const history::Estimate estimate = history::EstimateOf(config);
  return {{"points", config.history.points.size()},
          {"limit", config.history.limit},
          {"bytes_a_day_least", estimate.least},
          {"bytes_a_day_most", estimate.most},
          {"bytes_of_minutes", estimate.minutes},
          {"days_least", estimate.Days(config.history.limit, estimate.most)},
          {"days_most", estimate.Days(config.history.limit, estimate.least)}};
}

}  // namespace baudgate
