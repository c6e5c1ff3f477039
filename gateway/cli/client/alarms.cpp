// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/client/alarms.h"

#include <vector>

#include "gateway/base/shown.h"
#include "gateway/cli/client/record_pages.h"
#include "gateway/cli/terminal/stream_table.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

/// Of "3:5", channel and code of a device's event, ", channel 3".
std::string ChannelOf(const Json& alarm) {
  if (!FieldText(alarm, "point").empty()) return {};
  const std::string name = FieldText(alarm, "name");
  const std::string channel = name.substr(0, name.find(':'));
  return channel.empty() || channel == "0" ? "" : ", channel " + channel;
}

StreamTable::Row AlarmRow(const Json& alarm) {
  std::string where = FieldText(alarm, "line") + "." + FieldText(alarm, "device");
  if (!FieldText(alarm, "point").empty()) where += "." + FieldText(alarm, "point");
  const std::string by = FieldText(alarm, "acknowledged_by");
  return {FieldText(alarm, "seq"),
          FieldText(alarm, "raised"),
          FieldText(alarm, "state"),
          FieldText(alarm, "priority"),
          where,
          FieldText(alarm, "text") + ChannelOf(alarm) + (by.empty() ? "" : " (" + by + ")")};
}

}  // namespace

int RunAlarms(const AlarmsOptions& options, std::ostream& out, std::ostream& err) {
  bool any = false;
  StreamTable table(
      {{"seq", 8, true}, {"raised", 24}, {"state", 12}, {"priority", 8}, {"of", 32}, {"text"}},
      options.width);
  const auto print = [&](const Json& alarms) {
    std::vector<StreamTable::Row> rows;
    for (const Json& alarm : alarms) {
      if (options.json) {
        out << alarm.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else {
        rows.push_back(AlarmRow(alarm));
      }
      any = true;
    }
    table.Print(rows, out);
  };
  const int code = ReadPages({.request = {{"command", "alarms"}},
                              .state = "events",
                              .socket = options.socket,
                              .current = true},
                             print, out, err);
  if (code == kNotCurrent) {
    err << "baudgate: the list may lack alarms: what happens can not be kept\n";
  }
  if (code == 0 && !any) (options.json ? err : out) << "there is no alarm\n";
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
