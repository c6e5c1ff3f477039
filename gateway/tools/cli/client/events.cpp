// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/events.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/csv.h"
#include "gateway/tools/cli/client/record_pages.h"
#include "gateway/tools/terminal/stream_table.h"
#include "gateway/tools/terminal/wrap.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

/// As the numbers of clock_quality (docs/events.md).
constexpr std::array<std::string_view, 5> kClocks = {"none", "gateway", "device", "minute guessed",
                                                     "out of step"};
constexpr std::array<const char*, 10> kFields = {
    "seq",    "receive_time", "device_time", "clock_quality", "line",
    "device", "channel",      "code",        "state",         "text"};
constexpr std::size_t kLongestLine = 110;
constexpr std::string_view kIndent = "          ";

std::vector<StreamTable::Column> EventColumns() {
  return {{"seq", 8, true},  {"received", 24}, {"time of the device", 24},
          {"its clock", 14}, {"device", 24},   {"chan", 4, true},
          {"code", 5, true}, {"state", 7},     {"text"}};
}

StreamTable::Row EventRow(const Json& record) {
  const std::string device = FieldText(record, "device");
  const auto clock = record.value("clock_quality", std::size_t{0});
  return {FieldText(record, "seq"),
          FieldText(record, "receive_time"),
          FieldText(record, "device_time"),
          clock < kClocks.size() ? std::string(kClocks[clock]) : std::to_string(clock),
          FieldText(record, "line") + (device.empty() ? "" : "." + device),
          FieldText(record, "channel"),
          FieldText(record, "code"),
          FieldText(record, "state"),
          FieldText(record, "text")};
}

/// "record1_current_l1 5.2 xIn", "record1_current_l2 none (bad: not connected)".
std::string ValueText(const Json& value) {
  const std::string shown = FieldText(value, "value");
  const std::string unit = FieldText(value, "unit");
  const std::string quality = FieldText(value, "quality_text");
  std::string text = FieldText(value, "name") + " " + (shown.empty() ? "none" : shown);
  if (!shown.empty() && !unit.empty()) text += " " + unit;
  if (quality != "good") text += " (" + quality + ")";
  return text;
}

/// Values that were kept with an event, and whether they are complete.
struct Kept {
  std::string title{};  ///< "trip, read 2026-11-23T12:00:03.120Z"; empty: nothing belongs to it
  std::vector<std::string> values{};
};

Kept KeptOf(const Json& event) {
  const auto found = event.find("record");
  if (found == event.end() || !found->is_object()) return {};
  const std::string state = FieldText(*found, "state");
  Kept kept{FieldText(*found, "name") + ", " + (state == "owed" ? "not read yet" : state)};
  if (state == "read") kept.title += " " + FieldText(*found, "read_time");
  if (const std::string why = FieldText(*found, "text"); !why.empty()) kept.title += ": " + why;
  for (const Json& value : found->value("values", Json::array())) {
    kept.values.push_back(ValueText(value));
  }
  return kept;
}

/// Indented, below its event.
std::string KeptRows(const Kept& kept, std::size_t width) {
  if (kept.title.empty()) return {};
  const std::size_t longest = width == 0 ? kLongestLine : width - std::min(width, kIndent.size());
  std::string rows;
  for (const std::string& line : WrapLines(kept.title, longest)) {
    rows.append(kIndent).append(line).append("\n");
  }
  std::string line;
  const auto end_line = [&] {
    if (!line.empty()) rows.append(kIndent).append("  ").append(line).append("\n");
    line.clear();
  };
  for (const std::string& value : kept.values) {
    if (line.size() + value.size() + 4 > longest) end_line();
    line += (line.empty() ? "" : "; ") + value;
  }
  end_line();
  return rows;
}

/// In one cell.
std::string KeptCell(const Kept& kept) {
  std::string cell = kept.title;
  for (const std::string& value : kept.values) cell += "; " + value;
  return cell;
}

class EventPrinter {
 public:
  EventPrinter(const EventsOptions& options, std::ostream& out, std::ostream& err)
      : options_(options), out_(out), err_(err), table_(EventColumns(), options.width) {}

  void Print(const Json& records) {
    if (options_.csv && !std::exchange(headed_, true)) {
      std::vector<std::string> head(std::begin(kFields), std::end(kFields));
      head.emplace_back("record");
      out_ << CsvLine(head);
    }
    for (const Json& record : records) {
      if (options_.json) {
        out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else if (options_.csv) {
        std::vector<std::string> row;
        for (const char* field : kFields) row.push_back(FieldText(record, field));
        row.push_back(KeptCell(KeptOf(record)));
        out_ << CsvLine(row);
      } else {
        PrintRow(EventRow(record), KeptOf(record));
      }
      any_ = true;
    }
    Flush();
  }

  void End() {
    if (any_) return;
    std::ostream& where = options_.json || options_.csv ? err_ : out_;
    const bool all = !options_.since && options_.device.empty() && options_.from <= 1;
    where << (all ? "nothing has happened yet\n" : "nothing of that has happened\n");
  }

 private:
  /// Rows are aligned together up to the next that has something below it.
  void PrintRow(StreamTable::Row row, const Kept& kept) {
    rows_.push_back(std::move(row));
    if (kept.title.empty()) return;
    Flush();
    out_ << KeptRows(kept, options_.width);
  }
  void Flush() { table_.Print(std::exchange(rows_, {}), out_); }

  const EventsOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  StreamTable table_;
  std::vector<StreamTable::Row> rows_;
  bool headed_ = false;
  bool any_ = false;
};

}  // namespace

int RunEvents(const EventsOptions& options, std::ostream& out, std::ostream& err) {
  Json request = {{"command", "events"}, {"after", options.from - 1}};
  if (!options.device.empty()) request["target"] = options.device;
  if (options.since) request["since_ms"] = options.since->time_since_epoch() / 1ms;
  EventPrinter printer(options, out, err);
  const int code = ReadPages(
      {request, "events", options.follow, options.seconds, options.socket},
      [&](const Json& records) { printer.Print(records); }, out, err);
  if (code == 0 && !options.follow) printer.End();
  return code;
}

}  // namespace baudgate
