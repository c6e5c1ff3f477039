// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/billing.h"

#include <array>
#include <chrono>
#include <compare>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "gateway/base/csv.h"
#include "gateway/base/since.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/history_stream.h"
#include "gateway/tools/cli/client/record_pages.h"
#include "gateway/tools/terminal/text_table.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;
using Day = std::chrono::sys_days;
using std::chrono::days;
using std::chrono::floor;

constexpr int kMostTariffs = 8;
constexpr std::array<const char*, 2> kPeriods = {"month", "day"};
constexpr std::array<const char*, 4> kRegisters = {"active_import", "active_export",
                                                   "reactive_import", "reactive_export"};

struct Key {
  std::size_t device = 0;  // of the options
  std::size_t period = 0;  // of kPeriods
  Day date{};
  int tariff = 0;  // 0: all together
  auto operator<=>(const Key&) const = default;
};

struct BillingRow {
  std::string time;
  std::array<Json, kRegisters.size()> values{};
  std::string quality{};  // of what is not good
};

using BillingRows = std::map<Key, BillingRow>;

/// The date by the meter, of which the time is the midnight: 2026-10-31T21:00Z is the first of
/// November at +03:00. From -11:59 to +12:00.
Day DateOf(WallTime midnight) { return floor<days>(midnight + 12h); }

bool IsWanted(Day date, const HistoryOptions& options) {
  if (options.since && date < floor<days>(*options.since)) return false;
  return !options.until || date < *options.until;
}

class Reader {
 public:
  Reader(ControlClient& client, const HistoryOptions& options)
      : client_(client), options_(options), asked_(options) {
    if (asked_.since) *asked_.since -= days(2);
    if (asked_.until) *asked_.until += days(2);
  }

  /// The exit code; what is not kept is no error, as long as something else is.
  int Read(std::size_t device, std::ostream& err) {
    bool any = false;
    for (std::size_t period = 0; period < kPeriods.size(); ++period) {
      for (int tariff = 0; tariff <= kMostTariffs; ++tariff) {
        for (std::size_t i = 0; i < kRegisters.size(); ++i) {
          if (const int code = ReadOne({device, period, {}, tariff}, i, any); code != 0) {
            err << told_.str();
            return code;
          }
        }
      }
    }
    if (any) return 0;
    const std::string told = told_.str();  // of the first name is enough
    err << told.substr(0, told.find('\n') + 1);
    return kUnknown;
  }

  const BillingRows& rows() const { return rows_; }

 private:
  static constexpr int kUnknown = 2;

  int ReadOne(Key key, std::size_t which, bool& any) {
    std::string name =
        options_.points[key.device] + '.' + kPeriods[key.period] + '.' + kRegisters[which];
    if (key.tariff > 0) name += "_t" + std::to_string(key.tariff);
    HistoryStream stream(client_, asked_, name, told_);
    while (true) {
      const Json* record = nullptr;
      const int code = stream.Next(record);
      if (code == kUnknown) return 0;
      if (code != 0) return code;
      any = true;
      if (record == nullptr) return 0;
      Add(key, which, *record);
      stream.Pop();
    }
  }

  void Add(Key key, std::size_t which, const Json& record) {
    const std::string time = FieldText(record, "time");
    const auto midnight = ParseWallTime(time);
    if (!midnight) return;
    key.date = DateOf(*midnight);
    if (!IsWanted(key.date, options_)) return;
    BillingRow& row = rows_[key];
    row.time = time;
    row.values[which] = record.value("value", Json());
    const std::string quality = FieldText(record, "quality_text");
    if (quality != "good") row.quality = quality;
  }

  ControlClient& client_;
  const HistoryOptions& options_;
  HistoryOptions asked_;
  std::ostringstream told_;
  BillingRows rows_;
};

std::string CellText(const Json& value) { return value.is_null() ? std::string() : value.dump(); }

std::string DateText(Day date) { return FormatWallTime(WallTime(date)).substr(0, 10); }

std::string TariffText(int tariff) { return tariff == 0 ? "all" : std::to_string(tariff); }

void PrintTable(const BillingRows& rows, const HistoryOptions& options, std::ostream& out) {
  config::TextTable table({"meter", "reading", "date", "tariff", "import kWh", "export kWh",
                           "import kvarh", "export kvarh", "quality"});
  for (const auto& [key, row] : rows) {
    table.Add({options.points[key.device], kPeriods[key.period], DateText(key.date),
               TariffText(key.tariff), CellText(row.values[0]), CellText(row.values[1]),
               CellText(row.values[2]), CellText(row.values[3]), row.quality});
  }
  table.PrintAligned(out, "", options.width);
}

/// Dates and numbers as spreadsheets know them.
void PrintCsv(const BillingRows& rows, const HistoryOptions& options, std::ostream& out) {
  const std::vector<std::string> head = {"meter",
                                         "reading",
                                         "date",
                                         "tariff",
                                         "active_import_kwh",
                                         "active_export_kwh",
                                         "reactive_import_kvarh",
                                         "reactive_export_kvarh",
                                         "quality_text"};
  out << CsvLine(head);
  for (const auto& [key, row] : rows) {
    std::vector<std::string> cells = {options.points[key.device], std::string(kPeriods[key.period]),
                                      DateText(key.date), TariffText(key.tariff)};
    for (const Json& value : row.values) cells.push_back(CellText(value));
    cells.push_back(row.quality.empty() ? "good" : row.quality);
    out << CsvLine(cells);
  }
}

void PrintJson(const BillingRows& rows, const HistoryOptions& options, std::ostream& out) {
  for (const auto& [key, row] : rows) {
    Json json = {{"meter", options.points[key.device]},
                 {"reading", kPeriods[key.period]},
                 {"date", DateText(key.date)},
                 {"time", row.time},
                 {"tariff", key.tariff}};
    for (std::size_t i = 0; i < kRegisters.size(); ++i) json[kRegisters[i]] = row.values[i];
    json["quality_text"] = row.quality.empty() ? "good" : row.quality;
    out << json.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
  }
}

}  // namespace

int RunBilling(const HistoryOptions& options, std::ostream& out, std::ostream& err) {
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  Reader reader(*client, options);
  for (std::size_t device = 0; device < options.points.size(); ++device) {
    if (const int code = reader.Read(device, err); code != 0) return code;
  }
  const BillingRows& rows = reader.rows();
  if (rows.empty()) {
    (options.json || options.csv ? err : out) << "no billing readings are kept of that time\n";
  }
  if (options.json) {
    PrintJson(rows, options, out);
  } else if (options.csv) {
    PrintCsv(rows, options, out);
  } else if (!rows.empty()) {
    PrintTable(rows, options, out);
  }
  return 0;
}

}  // namespace baudgate
