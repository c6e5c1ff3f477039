// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/alarms.h"

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/tools/cli/client/record_pages.h"
#include "gateway/tools/terminal/stream_table.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

/// ", channel 3" for "3:5", channel and code of a device's event.
std::string ChannelOf(const Json& alarm) {
  const std::string name = FieldText(alarm, "name");
  const std::size_t colon = name.find(':');
  if (!FieldText(alarm, "point").empty() || colon == std::string::npos) return {};
  const std::string channel = name.substr(0, colon);
  return channel == "0" ? "" : ", channel " + channel;
}

/// As `ack` takes it.
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

/// What of the whole list is another than the time before. One that is not listed any more is
/// normal.
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
    err << "baudgate: the list may lack alarms, because events cannot be kept\n";
  }
  if (code == 0 && !printer.any() && !options.follow) {
    (options.json ? err : out) << "there is no alarm\n";
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
  err << "baudgate: not on the disk yet: " << trouble << '\n';
  return kNotCurrent;
}

}  // namespace baudgate
