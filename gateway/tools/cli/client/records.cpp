// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/records.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

using Json = ControlClient::Json;
using Got = ControlClient::Got;

constexpr int kNotCurrent = 4;

constexpr Duration kLookForRecords = 500ms;

struct RecordPages {
  ControlClient::Json request;
  /// The answer's key for the state of the record file: "events" or "audit".
  const char* state = "";
  bool follow = false;
  std::optional<Duration> seconds{};  ///< with `follow`: end after this time
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
  /// True: ReadPages returns kNotCurrent if the gateway cannot write the record file, because
  /// records may then be missing.
  bool current = false;
  /// True, with `follow`: every 0.5 s reads all records, not only new ones, and calls `looked`.
  bool whole = false;
  std::function<void()> looked{};
};

/// Prints the gateway's advice on its record file when the state of the file has changed.
class Troubles {
 public:
  Troubles(std::string key, std::ostream& err) : key_(std::move(key)), err_(err) {}

  const std::string& Tell(const Json& answer) {
    const auto found = answer.find(key_);
    if (found == answer.end() || !found->is_object()) return told_;
    const std::string state = FieldText(*found, "state");
    if (state == told_) return told_;
    for (const Json& sentence : found->value("advice", Json::array())) {
      if (!sentence.is_string()) continue;
      err_ << "baudgate: " << key_ << ": " << sentence.get<std::string>() << '\n';
    }
    return told_ = state;
  }
  bool none() const { return told_.empty() || told_ == "fine" || told_ == "opening"; }

 private:
  const std::string key_;
  std::ostream& err_;
  std::string told_;
};

/// Reads all pages, and calls `print` with the records of each page (maybe none). Reads again every
/// 0.5 s with `follow`, or while a gateway that has just started still opens its record file.
/// Returns the exit code.
int ReadPages(const RecordPages& pages, const std::function<void(const Json& records)>& print,
              std::ostream& out, std::ostream& err) {
  const StopSignals signals;
  std::optional<Instant> until;
  if (pages.seconds) until = ReadClocks().instant + *pages.seconds;
  auto client = ConnectOrTell(pages.socket, err);
  if (!client) return kNoDaemon;
  Json request = pages.request;
  Troubles troubles(pages.state, err);
  for (;;) {
    Json answer;
    if (const int code = ReadAnswer(*client, request, answer, err); code != 0) return code;
    const bool opening = troubles.Tell(answer) == "opening";
    print(answer.value("records", Json::array()));
    out.flush();
    if (!out) return 0;  // the program that reads the output has closed it
    request["after"] = answer.value("next", std::int64_t{0});
    if (answer.value("more", false)) continue;
    if (pages.looked) pages.looked();
    out.flush();
    if (pages.whole) request["after"] = 0;
    if (!pages.follow && !opening) return pages.current && !troubles.none() ? kNotCurrent : 0;
    const Instant next = ReadClocks().instant + kLookForRecords;
    std::string line;
    const Got got = client->ReadLine(line, next, signals.descriptor());
    if (got == Got::stopped || (until && next >= *until)) return 0;
    if (got == Got::end) {
      err << "baudgate: the gateway has closed the connection\n";
      return kNoDaemon;
    }
  }
}

}  // namespace

std::string FieldText(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return {};
  return Harmless(found->is_string() ? found->get<std::string>() : found->dump());
}

namespace {

using Json = ControlClient::Json;

/// The names of the values 0…4 of clock_quality (docs/events.md).
constexpr std::array<std::string_view, 5> kClocks = {"none", "gateway", "device", "minute guessed",
                                                     "out of step"};
constexpr std::array<const char*, 11> kFields = {
    "seq",     "receive_time", "device_time", "clock_quality", "line", "device",
    "channel", "code",         "state",       "priority",      "text"};
constexpr std::size_t kLongestLine = 110;
constexpr std::string_view kIndent = "          ";

std::vector<StreamTable::Column> EventColumns() {
  return {{"seq", 8, true}, {"received", 24},  {"time of the device", 24}, {"its clock", 14},
          {"device", 24},   {"chan", 4, true}, {"code", 5, true},          {"state", 7},
          {"priority", 8},  {"text"}};
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
          FieldText(record, "priority"),
          FieldText(record, "text")};
}

/// Examples: "record1_current_l1 5.2 xIn", "record1_current_l2 none (bad: not connected)".
std::string ValueText(const Json& value) {
  const std::string shown = FieldText(value, "value");
  const std::string unit = FieldText(value, "unit");
  const std::string quality = FieldText(value, "quality_text");
  std::string text = FieldText(value, "name") + " " + (shown.empty() ? "none" : shown);
  if (!shown.empty() && !unit.empty()) text += " " + unit;
  if (quality != "good") text += " (" + quality + ")";
  return text;
}

struct Kept {
  /// Name and state of the saved record. Example: "trip, read 2026-11-23T12:00:03.120Z"; empty: the
  /// event has no saved record.
  std::string title{};
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
    const bool all = !options_.since && options_.device.empty() && options_.priority.empty() &&
                     options_.from <= 1;
    where << (all ? "there are no events yet\n" : "no events match\n");
  }

 private:
  /// Collects rows that will share their column widths. An event with a saved record ends the
  /// group: the group is printed, and the values of the record below it.
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
  if (!options.priority.empty()) request["priority"] = options.priority;
  if (options.since) request["since_ms"] = options.since->time_since_epoch() / 1ms;
  EventPrinter printer(options, out, err);
  const int code = ReadPages(
      {request, "events", options.follow, options.seconds, options.socket},
      [&](const Json& records) { printer.Print(records); }, out, err);
  if (code == 0 && !options.follow) printer.End();
  return code;
}

namespace {

using Json = ControlClient::Json;

/// Returns ", channel 3" for the alarm "3:5" of a device (channel 3, code 5); empty: the alarm has
/// no channel.
std::string ChannelOf(const Json& alarm) {
  const std::string name = FieldText(alarm, "name");
  const std::size_t colon = name.find(':');
  if (!FieldText(alarm, "point").empty() || colon == std::string::npos) return {};
  const std::string channel = name.substr(0, colon);
  return channel == "0" ? "" : ", channel " + channel;
}

/// Returns the place that `baudgate ack` accepts. Examples: "bay-1.feeder-1", "gateway".
std::string PlaceOf(const Json& alarm) {
  std::string place = FieldText(alarm, "line");
  for (const char* part : {"device", "point"}) {
    const std::string name = FieldText(alarm, part);
    if (!name.empty()) place += (place.empty() ? "" : ".") + name;
  }
  return place.empty() ? "gateway" : place;
}

StreamTable::Row AlarmRow(const Json& alarm) {
  const std::string by = FieldText(alarm, "acknowledged_by");
  return {FieldText(alarm, "seq"),
          FieldText(alarm, "raised"),
          FieldText(alarm, "state"),
          FieldText(alarm, "priority"),
          PlaceOf(alarm),
          FieldText(alarm, "text") + ChannelOf(alarm) + (by.empty() ? "" : " (" + by + ")")};
}

class AlarmPrinter {
 public:
  AlarmPrinter(const AlarmsOptions& options, std::ostream& out)
      : json_(options.json),
        table_({{"seq", 8, true},
                {"raised", 24},
                {"state", 12},
                {"priority", 8},
                {"of", 32},
                {"text"}},
               options.width),
        out_(out) {}

  void Print(const Json& alarms) {
    std::vector<StreamTable::Row> rows;
    for (const Json& alarm : alarms) {
      if (json_) {
        out_ << alarm.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else {
        rows.push_back(AlarmRow(alarm));
      }
      any_ = true;
    }
    if (!json_) table_.Print(rows, out_);
  }
  bool any() const { return any_; }

 private:
  const bool json_;
  StreamTable table_;
  std::ostream& out_;
  bool any_ = false;
};

/// Finds the alarms that have changed between two readings of all alarms. An alarm that is no
/// longer listed is normal again.
class AlarmChanges {
 public:
  void Add(const Json& alarms) {
    for (const Json& alarm : alarms) {
      const auto key = std::array{FieldText(alarm, "line"), FieldText(alarm, "device"),
                                  FieldText(alarm, "name")};
      now_.insert_or_assign(key, alarm);
    }
  }
  template <typename Print>
  void Tell(Print print) {
    for (auto& [key, alarm] : before_) {
      if (now_.contains(key)) continue;
      alarm["state"] = "normal";
      print(alarm);
    }
    for (const auto& [key, alarm] : now_) {
      const auto was = before_.find(key);
      if (was == before_.end() || was->second != alarm) print(alarm);
    }
    before_ = std::exchange(now_, {});
  }

 private:
  std::map<std::array<std::string, 3>, Json> before_;
  std::map<std::array<std::string, 3>, Json> now_;
};

}  // namespace

int RunAlarms(const AlarmsOptions& options, std::ostream& out, std::ostream& err) {
  AlarmPrinter printer(options, out);
  AlarmChanges changes;
  const auto one = [&printer](const Json& alarm) { printer.Print(Json::array({alarm})); };
  const auto print = [&](const Json& alarms) {
    if (options.follow) return changes.Add(alarms);
    printer.Print(alarms);
  };
  RecordPages pages{.request = {{"command", "alarms"}}, .state = "events"};
  pages.follow = pages.whole = options.follow;
  pages.socket = options.socket;
  pages.current = true;
  if (options.follow) pages.looked = [&] { changes.Tell(one); };
  const int code = ReadPages(pages, print, out, err);
  if (code == kNotCurrent) {
    err << "baudgate: the list may lack alarms, because events cannot be stored; see 'baudgate "
           "status'\n";
  }
  if (code == 0 && !printer.any() && !options.follow) {
    (options.json ? err : out) << "there are no alarms\n";
  }
  return code;
}

int RunAck(const AckOptions& options, std::ostream& out, std::ostream& err) {
  Json answer;
  const Json request = {{"command", "ack"}, {"target", options.target}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  const auto count = answer.value("acknowledged", std::uint64_t{0});
  if (count == 0) {
    out << "no alarm of " << options.target << " waits to be acknowledged\n";
    return 0;
  }
  out << Plural(count, "alarm") << " acknowledged\n";
  const std::string trouble = FieldText(answer, "trouble");
  if (trouble.empty()) return 0;
  err << "baudgate: the acknowledgement is not on the disk yet: " << trouble << '\n';
  return kNotCurrent;
}

namespace {

using Json = ControlClient::Json;

std::string ValueText(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return "-";
  if (found->is_string()) return Harmless(found->get<std::string>());
  return found->is_number_float() ? FormatNumber(found->get<double>()) : found->dump();
}

std::string Remark(const Json& record) {
  std::string text;
  const auto count = record.value("count", std::int64_t{1});
  if (count > 1) {
    text = fmt::format("{} times until {}", count, FieldText(record, "last_time"));
    const std::string first = ValueText(record, "first");
    if (first != "-") text += ", the first " + first;
  }
  const std::string reason = FieldText(record, "reason");
  return text.empty() || reason.empty() ? text + reason : text + "; " + reason;
}

StreamTable::Row RowOf(const Json& record) {
  std::string target;
  for (const char* key : {"line", "device", "point"}) {
    const std::string part = FieldText(record, key);
    if (!part.empty()) target += (target.empty() ? "" : ".") + part;
  }
  const std::string change = ValueText(record, "old") + " -> " + ValueText(record, "new");
  return {FieldText(record, "time"),
          FieldText(record, "client"),
          target,
          change,
          FieldText(record, "outcome"),
          Remark(record)};
}

std::vector<StreamTable::Column> WriteColumns() {
  return {{"time", 24},       {"client", 21}, {"point", 36},
          {"old -> new", 20}, {"outcome", 8}, {"reason"}};
}

class WritePrinter {
 public:
  WritePrinter(const WritesOptions& options, std::ostream& out, std::ostream& err)
      : options_(options), out_(out), err_(err), table_(WriteColumns(), options.width) {}

  void Print(const Json& records) {
    std::vector<StreamTable::Row> rows;
    for (const Json& record : records) {
      any_ = true;
      if (options_.json) {
        out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else {
        rows.push_back(RowOf(record));
      }
    }
    table_.Print(rows, out_);
  }

  void End() {
    if (any_) return;
    std::ostream& where = options_.json ? err_ : out_;
    where << "nothing has been written" << (options_.since ? " since then" : " yet") << '\n';
  }

 private:
  const WritesOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  StreamTable table_;
  bool any_ = false;
};

}  // namespace

int RunWrites(const WritesOptions& options, std::ostream& out, std::ostream& err) {
  Json request = {{"command", "writes"}, {"after", 0}};
  if (options.follow) request["order"] = "settled";
  if (options.since) request["since_ms"] = options.since->time_since_epoch() / 1ms;
  WritePrinter printer(options, out, err);
  const int code = ReadPages(
      {request, "audit", options.follow, options.seconds, options.socket},
      [&](const Json& records) { printer.Print(records); }, out, err);
  if (code == 0 && !options.follow) printer.End();
  return code;
}

}  // namespace baudgate::tools
