// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "gateway/base/exit_code.h"
#include "gateway/outputs/status/history_csv.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/history_stream.h"
#include "gateway/tools/cli/client/record_pages.h"
#include "gateway/tools/terminal/stream_table.h"

namespace baudgate {
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
      out_ << control::HistoryCsvRow(record, options_.every.has_value());
    } else {
      rows_.push_back(RowOf(record));
      if (rows_.size() >= kTogether) Flush();
    }
  }
  void Flush() { table_.Print(std::exchange(rows_, {}), out_); }
  void PrintCsvHead() {
    out_ << (options_.every ? "time_utc,point,mean,min,max,first,last,count,seconds_good\r\n"
                            : "time_utc,point,value,quality,quality_text\r\n");
  }

 private:
  static constexpr std::size_t kTogether = 1000;  // rows whose columns are aligned at once

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
    if (record.contains("gap")) return {time, point, "-", control::GapText(record)};
    return {time, point, Shown(record, "value"), FieldText(record, "quality_text")};
  }

  const HistoryOptions& options_;
  std::ostream& out_;
  StreamTable table_;
  std::vector<StreamTable::Row> rows_;
};

/// What is named, and what patterns mean; each once. The exit code.
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

/// True: something is missing in what was printed.
bool TellUnread(const std::vector<HistoryStream>& streams, std::ostream& err) {
  std::set<std::string> told;
  for (const HistoryStream& stream : streams) {
    for (const std::string& text : stream.unread()) {
      if (told.insert(text).second)
        err << "baudgate: " << text << "; its values are missing here\n";
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
      printer.Flush();
      if (TellUnread(streams, err)) return kExitCanNot;
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
