// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/client/history.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "gateway/cli/client/control_client.h"
#include "gateway/cli/client/csv.h"
#include "gateway/cli/client/history_stream.h"
#include "gateway/cli/client/record_pages.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

constexpr std::array<const char*, 7> kSpanFields = {"mean", "min",   "max",         "first",
                                                    "last", "count", "seconds_good"};

std::string Shown(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return "-";
  return FieldText(record, key);
}

std::string GapText(const Json& record) {
  const std::string why = FieldText(record, "gap");
  const std::string until = FieldText(record, "until");
  if (why == "clock") return "gap: the clock was set to " + until;
  if (why == "dropped") return "gap: the disk took no values until " + until;
  if (why == "overwritten") return "gap: the meter has it no more, until " + until;
  return "gap: the gateway was down until " + until;
}

class HistoryPrinter {
 public:
  HistoryPrinter(const HistoryOptions& options, std::ostream& out) : options_(options), out_(out) {}

  void Print(const Json& record) {
    if (options_.json) {
      out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
    } else if (options_.csv) {
      Head();
      PrintCsv(record);
    } else {
      Head();
      PrintRow(record);
    }
  }
  void Head() {
    if (std::exchange(headed_, true) || options_.json) return;
    if (options_.csv) {
      out_ << (options_.every ? "time_utc,point,mean,min,max,first,last,count,seconds_good\r\n"
                              : "time_utc,point,value,quality,quality_text\r\n");
    } else if (options_.every) {
      out_ << fmt::format(kSpanRow, "from", "point", "mean", "min", "max", "first", "last", "count",
                          "good s");
    } else {
      out_ << fmt::format(kRow, "time", "point", "value", "quality");
    }
  }

 private:
  static constexpr const char* kRow = "{:<24}  {:<32}  {:>16}  {}\n";
  static constexpr const char* kSpanRow =
      "{:<24}  {:<32}  {:>12}  {:>12}  {:>12}  {:>12}  {:>12}  {:>7}  {:>8}\n";

  static std::string Rounded(const Json& record, const char* key) {
    const auto found = record.find(key);
    if (found == record.end() || !found->is_number()) return "-";
    return fmt::format("{:.7g}", found->get<double>());
  }

  void PrintRow(const Json& record) {
    const std::string time = FieldText(record, "time");
    const std::string point = FieldText(record, "point");
    if (options_.every) {
      out_ << fmt::format(kSpanRow, time, point, Rounded(record, "mean"), Rounded(record, "min"),
                          Rounded(record, "max"), Rounded(record, "first"), Rounded(record, "last"),
                          Shown(record, "count"), Rounded(record, "seconds_good"));
    } else if (record.contains("gap")) {
      out_ << fmt::format(kRow, time, point, "-", GapText(record));
    } else {
      out_ << fmt::format(kRow, time, point, Shown(record, "value"),
                          FieldText(record, "quality_text"));
    }
  }

  /// Times as spreadsheets know them; numbers as they are.
  void PrintCsv(const Json& record) {
    std::string time = FieldText(record, "time");
    if (time.size() == 24) {
      time[10] = ' ';
      time.pop_back();
    }
    out_ << time << ',' << CsvCell(FieldText(record, "point"));
    if (options_.every) {
      for (const char* field : kSpanFields) out_ << ',' << FieldText(record, field);
    } else {
      const auto value = record.find("value");
      const bool text = value != record.end() && value->is_string();
      const std::string shown = FieldText(record, "value");
      out_ << ',' << (text ? CsvCell(shown) : shown) << ',' << FieldText(record, "quality") << ','
           << CsvCell(record.contains("gap") ? GapText(record) : FieldText(record, "quality_text"));
    }
    out_ << "\r\n";
  }

  const HistoryOptions& options_;
  std::ostream& out_;
  bool headed_ = false;
};

}  // namespace

int RunHistory(const HistoryOptions& options, std::ostream& out, std::ostream& err) {
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  std::vector<HistoryStream> streams;
  for (const std::string& point : options.points) {
    streams.emplace_back(*client, options, point, err);
  }
  HistoryPrinter printer(options, out);
  if (options.csv) printer.Head();
  // The oldest of the next of each; in each they stay as they are, whatever the clock has done.
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
      if (!any) (options.json || options.csv ? err : out) << "nothing is kept of that time\n";
      return 0;
    }
    const Json* record = nullptr;
    oldest->Next(record);
    printer.Print(*record);
    oldest->Pop();
    if (!out) return 0;  // its reader has left
  }
}

}  // namespace baudgate
