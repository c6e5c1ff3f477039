// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/operation.h"

#include <algorithm>
#include <thread>

#include "gateway/base/text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

using Json = ControlClient::Json;

constexpr int kNotClosed = 4;
constexpr Duration kLookForRelease = 20ms;

std::string Clock(const std::string& time) {
  return time.size() < 19 ? time : time.substr(11, 8) + " UTC";
}

struct Seen {
  int code = 0;
  bool reached = false;
  std::string state;
  std::string text;
};
Seen WaitFor(const ReleaseOptions& options, bool released, std::ostream& err) {
  const Instant until = ReadClocks().instant + options.patience;
  for (;;) {
    Json status;
    const int code =
        Ask(options.socket, {{"command", "status"}, {"target", options.line}}, status, err);
    if (code != 0) return {code, false, {}, {}};
    const Json line = status.value("lines", Json::array({Json::object()})).at(0);
    const std::string state = line.value("port_state", "");
    if ((state == "released") == released) {
      return {0, true, state, line.value("port_text", "")};
    }
    if (ReadClocks().instant >= until) return {0, false, state, line.value("port_text", "")};
    std::this_thread::sleep_for(kLookForRelease);
  }
}

int RunOffer(const ReleaseOptions& options, std::ostream& out, std::ostream& err) {
  Json answer;
  Json request = {{"command", "release"},
                  {"target", options.line},
                  {"for_ms", std::chrono::ceil<std::chrono::milliseconds>(options.time).count()},
                  {"tcp", options.tcp},
                  {"rfc2217", options.rfc2217}};
  if (!options.allow.empty()) request["allow"] = options.allow;
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  const std::string at = answer.value("at", "");
  const Instant until = ReadClocks().instant + options.patience;
  for (std::string trouble = "the gateway has not opened this TCP port yet";;
       std::this_thread::sleep_for(kLookForRelease)) {
    Json status;
    const Json ask = {{"command", "status"}, {"target", options.line}};
    if (const int code = Ask(options.socket, ask, status, err); code != 0) return code;
    const Json line = status.value("lines", Json::array({Json::object()})).at(0);
    for (const Json& service : line.value("services", Json::array())) {
      if (service.value("at", "") == at) trouble = service.value("trouble", "");
    }
    if (trouble.empty()) break;
    if (ReadClocks().instant < until) continue;
    err << "baudgate: " << options.line
        << ": the port was not lent, because no client can connect at " << at << ": " << trouble
        << '\n';
    Ask(options.socket, {{"command", "take_back"}, {"target", options.line}}, answer, err);
    return kNotClosed;
  }
  out << options.line << ": a client can use " << answer.value("port", "the port") << " at " << at
      << (options.rfc2217 ? " (RFC 2217)" : "") << " until " << Clock(answer.value("until", ""))
      << ". Polling stops when the client sends its first byte, and continues when the client "
         "disconnects\n";
  return 0;
}

int TakeBack(const ReleaseOptions& options, std::ostream& out, std::ostream& err) {
  Json answer;
  const Json request = {{"command", "take_back"}, {"target", options.line}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  if (!answer.value("was_released", true)) {
    out << options.line << ": the line was not released\n";
    return 0;
  }
  const Seen seen = WaitFor(options, false, err);
  if (seen.code != 0) return seen.code;
  out << options.line << ": the port was taken back, and is now " << seen.state
      << (seen.text.empty() ? "" : ": " + seen.text) << '\n';
  return 0;
}

}  // namespace

int RunRelease(const ReleaseOptions& options, std::ostream& out, std::ostream& err) {
  if (options.end) return TakeBack(options, out, err);
  if (!options.tcp.empty()) return RunOffer(options, out, err);
  Json answer;
  const Json request = {
      {"command", "release"},
      {"target", options.line},
      {"for_ms", std::chrono::ceil<std::chrono::milliseconds>(options.time).count()}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  const Seen seen = WaitFor(options, true, err);
  if (seen.code != 0) return seen.code;
  if (!seen.reached) {
    err << "baudgate: " << options.line
        << ": the port is not closed yet, because its driver is busy; use the port "
           "only when 'baudgate status "
        << options.line << "' shows it as released\n";
    return kNotClosed;
  }
  out << options.line << ": " << answer.value("port", "the port")
      << " is free for another program until " << Clock(answer.value("until", ""))
      << ", and the points of the line are out of service. To give the port back earlier, run "
      << "'baudgate release " << options.line << " --end'\n";
  return 0;
}

namespace {

using Json = ControlClient::Json;

int Tell(const Json& answer, std::ostream& out, std::ostream& err) {
  const bool ok = answer.value("ok", false);
  for (const Json& warning : answer.value("warnings", Json::array())) {
    err << warning.get<std::string>() << '\n';
  }
  for (const Json& change : answer.value("changes", Json::array())) {
    out << change.get<std::string>() << '\n';
  }
  const std::string text = answer.value("text", "");
  if (ok) {
    out << text << '\n';
  } else {
    err << text << '\n';
  }
  return ok ? 0 : answer.value("exit", 2);
}

}  // namespace

int RunReload(const ReloadCommand& options, std::ostream& out, std::ostream& err) {
  Json request = {{"command", "reload"}, {"dry_run", options.dry_run}};
  if (options.confirm) request["confirm_ms"] = *options.confirm / 1ms;
  Json answer;
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  if (options.json) {
    out << answer.dump() << '\n';
    return answer.value("ok", false) ? 0 : answer.value("exit", 2);
  }
  const int code = Tell(answer, out, err);
  const std::chrono::milliseconds left(answer.value("confirm_ms", std::int64_t{0}));
  if (left > 0ms) {
    out << "the gateway goes back to the confirmed configuration in " << FormatDuration(left)
        << ", or when devices stop answering, unless you run: baudgate confirm\n";
  }
  return code;
}

namespace {

int EndTrial(const char* command, const std::string& socket, std::ostream& out, std::ostream& err) {
  Json answer;
  if (const int code = Ask(socket, {{"command", command}}, answer, err); code != 0) return code;
  return Tell(answer, out, err);
}

}  // namespace

int RunConfirm(const ConfirmCommand& options, std::ostream& out, std::ostream& err) {
  return EndTrial("confirm", options.socket, out, err);
}

int RunRevert(const ConfirmCommand& options, std::ostream& out, std::ostream& err) {
  return EndTrial("revert", options.socket, out, err);
}

namespace {

using Json = ControlClient::Json;

std::string Shown(const Json& point) {
  const std::string shown = point.value("shown", "");
  return shown.empty() ? "-" : shown;
}

std::string Age(const Json& age) {
  return age.is_null() ? "never" : FormatDuration(std::chrono::milliseconds(age.get<long>()));
}

/// Returns the quality of a value. Marks a value that was read before this request, so that users
/// do not take it for the result of the request.
std::string QualityOf(const Json& point, bool read) {
  const std::string quality = point.value("quality_text", "");
  if (read || point.value("fresh", false)) return quality;
  return point.value("age_ms", Json()).is_null() ? quality
                                                 : "not read now; last quality: " + quality;
}

void PrintPoints(const Json& points, bool read, std::ostream& out) {
  TextTable table({"point", "value", "unit", "quality", "age"});
  for (const Json& point : points) {
    table.Add({point.value("point", ""), Shown(point), point.value("unit", ""),
               QualityOf(point, read), Age(point.value("age_ms", Json()))});
  }
  table.PrintAligned(out);
}

std::string Advice(const WriteOptions& options, const Json& answer) {
  const std::string needs = answer.value("needs", "");
  if (needs == "confirm") {
    return "; this point needs a confirmation: run 'baudgate write " + options.target + " " +
           options.value + " --confirm'";
  }
  if (needs.empty()) return {};
  return "; to allow the write, add 'write: allow' or a list of points to the device in the "
         "configuration";
}

std::string Sentence(const WriteOptions& options, const Json& answer) {
  const std::string end = answer.value("end", "");
  const std::string reason = answer.value("reason", "");
  if (end == "ok") {
    const bool shown = answer.value("read_back", false);
    if (shown) return options.value + " written, and read back";
    return options.value + " written, and the device has confirmed the write; " +
           (reason.empty() ? "not read back" : reason + "; read the point again");
  }
  if (end == "unknown") {
    return "sent, but the result is unknown: " + reason + "; read the point before you try again";
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
      << "; older values are marked 'not read now'. See 'baudgate status'\n";
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
    err << "baudgate: " << options.target
        << ": the point may have been written; when the gateway runs again, check with 'baudgate "
           "writes'\n";
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
      << (options.in_use
              ? ": enabled; the gateway polls it again"
              : ": disabled; the gateway does not poll it, and its points are out of service");
  if (answer.value("enabled", true) != options.in_use) {
    out << ". This lasts until the gateway restarts; to keep it, set 'enabled: "
        << (options.in_use ? "true" : "false") << "' for the device in the configuration";
  }
  out << '\n';
  return 0;
}

}  // namespace baudgate::tools
