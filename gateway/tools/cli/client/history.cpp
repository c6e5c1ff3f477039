// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <compare>
#include <map>
#include <set>
#include <sstream>
#include <thread>
#include <utility>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/outputs/status/records_json.h"
#include "gateway/tools/cli/client/records.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

constexpr Duration kLookForHistory = 200ms;
constexpr int kLooks = 50;

}  // namespace

HistoryStream::HistoryStream(ControlClient& client, const HistoryOptions& options,
                             const std::string& point, std::ostream& err)
    : client_(client), request_({{"command", "history"}, {"point", point}}), err_(err) {
  if (options.since) request_["since_ms"] = options.since->time_since_epoch() / 1ms;
  if (options.until) request_["until_ms"] = options.until->time_since_epoch() / 1ms;
  if (options.every) request_["every_ms"] = *options.every / 1ms;
}

int HistoryStream::Next(const Json*& record) {
  record = nullptr;
  while (at_ >= page_.size()) {
    if (done_) return 0;
    if (const int code = Fetch(); code != 0) return code;
  }
  record = &page_[at_];
  return 0;
}

int HistoryStream::Fetch() {
  Json answer;
  for (int look = 0; look < kLooks; ++look) {
    if (const int code = ReadAnswer(client_, request_, answer, err_); code != 0) return code;
    const auto history = answer.find("history");
    if (history == answer.end() || FieldText(*history, "state") != "opening") break;
    // A gateway that has just started is still opening its history.
    std::this_thread::sleep_for(kLookForHistory);
  }
  page_ = answer.value("records", Json::array());
  for (const Json& text : answer.value("unread", Json::array())) unread_.push_back(text);
  at_ = 0;
  done_ = !answer.value("more", false);
  request_["after"] = answer.value("next", Json::array());
  return 0;
}

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
  std::size_t device = 0;  // index in HistoryOptions::points
  std::size_t period = 0;  // index in kPeriods
  Day date{};
  int tariff = 0;  // 0: the total of all tariffs
  auto operator<=>(const Key&) const = default;
};

struct BillingRow {
  std::string time;
  std::array<Json, kRegisters.size()> values{};
  std::string quality{};  // qualities of the values whose quality is not good
};

using BillingRows = std::map<Key, BillingRow>;

/// Returns the meter's local date that begins at `midnight` UTC. Example: 2026-10-31T21:00Z is the
/// first of November at +03:00. Works for UTC offsets from -11:59 to +12:00.
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

  /// Reads all billing values of a device and returns the exit code. A value that is not recorded
  /// is an error only if no value of the device is recorded.
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
    const std::string told = told_.str();  // all messages say the same, so one is printed
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
  TextTable table({"meter", "reading", "date", "tariff", "import kWh", "export kWh", "import kvarh",
                   "export kvarh", "quality"});
  for (const auto& [key, row] : rows) {
    table.Add({options.points[key.device], kPeriods[key.period], DateText(key.date),
               TariffText(key.tariff), CellText(row.values[0]), CellText(row.values[1]),
               CellText(row.values[2]), CellText(row.values[3]), row.quality});
  }
  table.PrintAligned(out, "", options.width);
}

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
    (options.json || options.csv ? err : out)
        << "no billing readings are stored for the requested time\n";
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

namespace {

using Json = ControlClient::Json;

std::string Shown(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return "-";
  return FieldText(record, key);
}

std::vector<StreamTable::Column> ColumnsOf(const HistoryOptions& options) {
  if (!options.every) return {{"time", 24}, {"point", 32}, {"value", 16, true}, {"quality"}};
  return {{"from", 24},       {"point", 32},      {"mean", 12, true},
          {"min", 12, true},  {"max", 12, true},  {"first", 12, true},
          {"last", 12, true}, {"count", 7, true}, {"good s", 8, true}};
}

class HistoryPrinter {
 public:
  HistoryPrinter(const HistoryOptions& options, std::ostream& out)
      : options_(options), out_(out), table_(ColumnsOf(options), options.width) {}

  void Print(const Json& record) {
    if (options_.json) {
      out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
    } else if (options_.csv) {
      out_ << status::HistoryCsvRow(record, options_.every.has_value());
    } else {
      rows_.push_back(RowOf(record));
      if (rows_.size() >= kTogether) Flush();
    }
  }
  void Flush() { table_.Print(std::exchange(rows_, {}), out_); }
  void PrintCsvHead() { out_ << status::HistoryCsvHead(options_.every.has_value()); }

 private:
  static constexpr std::size_t kTogether = 1000;  // this many rows have the same column widths

  static std::string Rounded(const Json& record, const char* key) {
    const auto found = record.find(key);
    if (found == record.end() || !found->is_number()) return "-";
    return fmt::format("{:.7g}", found->get<double>());
  }

  StreamTable::Row RowOf(const Json& record) const {
    const std::string time = FieldText(record, "time");
    const std::string point = FieldText(record, "point");
    if (options_.every) {
      return {time,
              point,
              Rounded(record, "mean"),
              Rounded(record, "min"),
              Rounded(record, "max"),
              Rounded(record, "first"),
              Rounded(record, "last"),
              Shown(record, "count"),
              Rounded(record, "seconds_good")};
    }
    if (record.contains("gap")) return {time, point, "-", status::GapText(record)};
    const std::string shown = FieldText(record, "shown");
    return {time, point, shown.empty() ? Shown(record, "value") : shown,
            FieldText(record, "quality_text")};
  }

  const HistoryOptions& options_;
  std::ostream& out_;
  StreamTable table_;
  std::vector<StreamTable::Row> rows_;
};

/// Collects the named points, and the points that match a pattern; each point once. Returns the
/// exit code.
int PointsOf(const HistoryOptions& options, ControlClient& client, std::ostream& err,
             std::vector<std::string>& points) {
  const auto add = [&points](const std::string& point) {
    if (std::ranges::find(points, point) == points.end()) points.push_back(point);
  };
  for (const std::string& text : options.points) {
    if (text.find_first_of("*?") == std::string::npos) {
      add(text);
      continue;
    }
    Json answer;
    const Json request = {{"command", "kept_points"}, {"pattern", text}};
    if (const int code = ReadAnswer(client, request, answer, err); code != 0) return code;
    for (const Json& point : answer.value("points", Json::array())) add(point.get<std::string>());
  }
  return 0;
}

bool TellUnread(const std::vector<HistoryStream>& streams, std::ostream& err) {
  std::set<std::string> told;
  for (const HistoryStream& stream : streams) {
    for (const std::string& text : stream.unread()) {
      if (told.insert(text).second)
        err << "baudgate: " << text << "; the values of this file are missing here\n";
    }
  }
  return !told.empty();
}

}  // namespace

int RunHistory(const HistoryOptions& options, std::ostream& out, std::ostream& err) {
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  std::vector<std::string> points;
  if (const int code = PointsOf(options, *client, err, points); code != 0) return code;
  std::vector<HistoryStream> streams;
  for (const std::string& point : points) {
    streams.emplace_back(*client, options, point, err);
  }
  HistoryPrinter printer(options, out);
  if (options.csv) printer.PrintCsvHead();
  // Prints the oldest next record of all streams. The records of one stream keep their order, even
  // if the clock was set back.
  for (bool any = false;; any = true) {
    HistoryStream* oldest = nullptr;
    std::string time;
    for (HistoryStream& stream : streams) {
      const Json* record = nullptr;
      if (const int code = stream.Next(record); code != 0) return code;
      if (record == nullptr) continue;
      const std::string its = FieldText(*record, "time");
      if (oldest != nullptr && its >= time) continue;
      oldest = &stream;
      time = its;
    }
    if (oldest == nullptr) {
      printer.Flush();
      if (TellUnread(streams, err)) return kExitCanNot;
      if (!any)
        (options.json || options.csv ? err : out)
            << "no values are stored for the requested time\n";
      return 0;
    }
    const Json* record = nullptr;
    oldest->Next(record);
    printer.Print(*record);
    oldest->Pop();
    if (!out) return 0;
  }
}

}  // namespace baudgate::tools
