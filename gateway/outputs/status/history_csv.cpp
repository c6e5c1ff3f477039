// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/history_csv.h"

#include <string>
#include <vector>

#include "gateway/base/csv.h"
#include "gateway/base/shown.h"

namespace baudgate::control {
namespace {

const std::vector<std::string> kSpanHead = {"time_utc", "point", "mean",  "min",         "max",
                                            "first",    "last",  "count", "seconds_good"};
const std::vector<std::string> kHead = {"time_utc", "point", "value", "quality", "quality_text"};

/// Empty where it is null or not there.
std::string FieldOf(const nlohmann::ordered_json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return {};
  // A text may have tabs and several lines, which a cell can hold.
  return Harmless(found->is_string() ? found->get<std::string>() : found->dump(), "\t\r\n");
}

}  // namespace

std::string HistoryCsvHead(bool spans) { return CsvLine(spans ? kSpanHead : kHead); }

std::string GapText(const nlohmann::ordered_json& record) {
  const std::string why = FieldOf(record, "gap");
  const std::string until = FieldOf(record, "until");
  if (why == "clock") return "gap: the clock was set to " + until;
  if (why == "standstill") return "gap: the gateway stood still until " + until;
  if (why == "dropped") return "gap: the disk took no values until " + until;
  if (why == "overwritten") return "gap: the meter has it no more, until " + until;
  return "gap: the gateway was down until " + until;
}

std::string HistoryCsvRow(const nlohmann::ordered_json& record, bool spans) {
  std::string time = FieldOf(record, "time");
  if (time.size() == 24) {
    time[10] = ' ';
    time.pop_back();
  }
  std::vector<std::string> row = {time};
  const std::vector<std::string>& head = spans ? kSpanHead : kHead;
  for (std::size_t i = 1; i < head.size(); ++i) row.push_back(FieldOf(record, head[i].c_str()));
  if (!spans && record.contains("gap")) row.back() = GapText(record);
  return CsvLine(row);
}

}  // namespace baudgate::control
