// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/operation.h"

#include <thread>

#include "gateway/tools/cli/client/control_client.h"

namespace baudgate {

namespace {

using Json = ControlClient::Json;

constexpr int kNotClosed = 4;
constexpr Duration kLookForRelease = 20ms;

/// "12:04:05 UTC" of an ISO time.
std::string Clock(const std::string& time) {
  return time.size() < 19 ? time : time.substr(11, 8) + " UTC";
}

/// Asks until the port's state is, or is not, `released`; the last line of status seen.
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

/// Asks until clients can come in.
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
  for (std::string trouble = "it does not listen yet";;
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
    err << "baudgate: " << options.line << ": no client can come in at " << at << ": " << trouble
        << '\n';
    Ask(options.socket, {{"command", "take_back"}, {"target", options.line}}, answer, err);
    return kNotClosed;
  }
  out << options.line << ": a client can have " << answer.value("port", "the port") << " at " << at
      << (options.rfc2217 ? " (RFC 2217)" : "") << " until " << Clock(answer.value("until", ""))
      << ". Polls go on until it sends its first byte, and again when it has left\n";
  return 0;
}

int TakeBack(const ReleaseOptions& options, std::ostream& out, std::ostream& err) {
  Json answer;
  const Json request = {{"command", "take_back"}, {"target", options.line}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  if (!answer.value("was_released", true)) {
    out << options.line << ": was not released\n";
    return 0;
  }
  const Seen seen = WaitFor(options, false, err);
  if (seen.code != 0) return seen.code;
  out << options.line << ": taken back; the port is " << seen.state
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
    err << "baudgate: " << options.line << ": the port is not closed yet, its driver is busy; see "
        << "'baudgate status " << options.line << "' before you use it\n";
    return kNotClosed;
  }
  out << options.line << ": " << answer.value("port", "the port")
      << " is free for another program until " << Clock(answer.value("until", ""))
      << "; its points are out of service meanwhile. It comes back by itself, or sooner by "
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
    out << "the gateway goes back in " << FormatDuration(left)
        << ", or when devices stop answering, unless you run: baudgate confirm\n";
  }
  return code;
}

int RunConfirm(const ConfirmCommand& options, std::ostream& out, std::ostream& err) {
  Json answer;
  if (const int code = Ask(options.socket, {{"command", "confirm"}}, answer, err); code != 0) {
    return code;
  }
  return Tell(answer, out, err);
}

}  // namespace baudgate
