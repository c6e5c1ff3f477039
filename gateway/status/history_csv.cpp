// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/history_csv.h"

#include <array>

#include "gateway/base/csv.h"
#include "gateway/base/shown.h"

namespace baudgate::control {
namespace {

constexpr std::array<const char*, 7> kSpanFields = {"mean", "min",   "max",         "first",
                                                    "last", "count", "seconds_good"};

/// Empty where it is null or not there.
std::string FieldOf(const nlohmann::ordered_json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return {};
  // A text may have tabs and several lines, which a cell can hold.
  return Harmless(found->is_string() ? found->get<std::string>() : found->dump(), "\t\r\n");
}

}  // namespace

std::string HistoryCsvHead(bool spans) {
  return spans ? "time_utc,point,mean,min,max,first,last,count,seconds_good\r\n"
               : "time_utc,point,value,quality,quality_text\r\n";
}

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
  std::string row = FieldOf(record, "time");
  if (row.size() == 24) {
    row[10] = ' ';
    row.pop_back();
  }
  row += "," + CsvCell(FieldOf(record, "point"));
  if (spans) {
    for (const char* key : kSpanFields) row += "," + FieldOf(record, key);
  } else {
    const auto value = record.find("value");
    const bool text = value != record.end() && value->is_string();
    const std::string shown = FieldOf(record, "value");
    row += "," + (text ? CsvCell(shown) : shown) + "," + FieldOf(record, "quality") + "," +
           CsvCell(record.contains("gap") ? GapText(record) : FieldOf(record, "quality_text"));
  }
  return row + "\r\n";
}

}  // namespace baudgate::control
