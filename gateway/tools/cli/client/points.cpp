// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/points.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate {

namespace {

using Json = ControlClient::Json;

std::string Shown(const Json& value) {
  if (value.is_null()) return "-";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string Age(const Json& age) {
  return age.is_null() ? "never" : FormatDuration(std::chrono::milliseconds(age.get<long>()));
}

/// What was known before must not pass for an answer.
std::string QualityOf(const Json& point, bool read) {
  const std::string quality = point.value("quality_text", "");
  if (read || point.value("fresh", false)) return quality;
  return point.value("age_ms", Json()).is_null() ? quality : "not read now; before: " + quality;
}

void PrintPoints(const Json& points, bool read, std::ostream& out) {
  config::TextTable table({"point", "value", "unit", "quality", "age"});
  for (const Json& point : points) {
    table.Add({point.value("point", ""), Shown(point.value("value", Json())),
               point.value("unit", ""), QualityOf(point, read),
               Age(point.value("age_ms", Json()))});
  }
  table.PrintAligned(out);
}

/// What a person does about it; empty: nothing.
std::string Advice(const WriteOptions& options, const Json& answer) {
  const std::string needs = answer.value("needs", "");
  if (needs == "confirm") {
    return "; it moves something; to confirm it, run 'baudgate write " + options.target + " " +
           options.value + " --confirm'";
  }
  if (needs.empty()) return {};
  return "; 'write: allow', or a list of points, at the device in the configuration lets it be "
         "written";
}

/// "bay-1.feeder-1.setting_group: refused: …".
std::string Sentence(const WriteOptions& options, const Json& answer) {
  const std::string end = answer.value("end", "");
  const std::string reason = answer.value("reason", "");
  if (end == "ok") {
    const bool shown = answer.value("read_back", false);
    if (shown) return options.value + " written, and read back";
    return options.value + " written, confirmed by the device; " +
           (reason.empty() ? "not read back" : reason + ": read it again");
  }
  if (end == "unknown") {
    return "sent, and nobody knows what became of it: " + reason + "; read it before you try again";
  }
  if (end == "not_sent") return "not sent: " + reason;
  if (end == "denied") return "not written: " + reason + Advice(options, answer);
  return end + ": " + reason;
}

}  // namespace

int RunRead(const ReadOptions& options, std::ostream& out, std::ostream& err) {
  Json answer;
  const Json request = {{"command", "read"}, {"target", options.target}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  const Json points = answer.value("points", Json::array());
  if (options.unasked) {
    answer["read"] = std::ranges::none_of(
        points, [](const Json& point) { return point.value("age_ms", Json()).is_null(); });
  }
  const bool read = answer.value("read", false);
  if (options.json) {
    out << answer.dump() << '\n';
  } else {
    PrintPoints(points, read || options.unasked, out);
  }
  if (read) return 0;
  if (options.passing) return kNotDone;
  err << "baudgate: " << options.target << ": " << answer.value("reason", "")
      << "; old values are marked; see 'baudgate status'\n";
  return kNotDone;
}

int RunWrite(const WriteOptions& options, std::ostream& out, std::ostream& err) {
  Json answer;
  Json request = {{"command", "write"},
                  {"target", options.target},
                  {"value", options.value},
                  {"confirm", options.confirm}};
  if (const auto slash = options.request.rfind('/'); slash != std::string::npos) {
    request["client"] = options.request.substr(0, slash);
    request["seq"] = ParseInteger<std::uint64_t>(options.request.substr(slash + 1)).value_or(0);
  }
  auto gateway = ConnectOrTell(options.socket, err);
  if (!gateway) return kNoDaemon;
  if (const int code = ReadAnswer(*gateway, request, answer, err); code != 0) {
    if (code != kNoDaemon) return code;
    err << "baudgate: " << options.target << ": it may have been written all the same; 'baudgate "
        << "writes' knows, once the gateway runs again\n";
    return kNotDone;
  }
  const bool done = answer.value("end", "") == "ok";
  if (options.json) {
    out << answer.dump() << '\n';
  } else {
    (done ? out : err) << options.target << ": " << Sentence(options, answer) << '\n';
  }
  return done ? 0 : kNotDone;
}

int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err) {
  ControlClient::Json answer;
  const ControlClient::Json request = {{"command", options.in_use ? "enable" : "disable"},
                                       {"target", options.target}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  out << options.target
      << (options.in_use ? ": in use, it is asked again"
                         : ": out of use, it is not asked and its points are out of service");
  // Said only where the restart changes something.
  if (answer.value("enabled", true) != options.in_use) {
    out << ". A restart forgets this: 'enabled: " << (options.in_use ? "true" : "false")
        << "' in the configuration keeps it";
  }
  out << '\n';
  return 0;
}

}  // namespace baudgate
