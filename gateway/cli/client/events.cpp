// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/client/events.h"

#include <fmt/format.h>

#include <array>

#include "gateway/base/shown.h"
#include "gateway/cli/client/control_client.h"
#include "gateway/cli/terminal/stop_signals.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;
using Got = ControlClient::Got;

constexpr Duration kLookAgain = 500ms;
constexpr const char* kRow = "{:>8}  {:<24}  {:<24}  {:<14}  {:<24}  {:>4}  {:>5}  {:<7}  {}\n";
/// As the numbers of clock_quality (docs/events.md).
constexpr std::array<std::string_view, 5> kClocks = {"none", "gateway", "device", "minute guessed",
                                                     "out of step"};
constexpr std::array<const char*, 10> kFields = {
    "seq",    "receive_time", "device_time", "clock_quality", "line",
    "device", "channel",      "code",        "state",         "text"};

std::string Text(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return {};
  return Harmless(found->is_string() ? found->get<std::string>() : found->dump());
}

std::string Row(const Json& record) {
  const auto clock = record.value("clock_quality", std::size_t{0});
  std::string row = fmt::format(
      kRow, Text(record, "seq"), Text(record, "receive_time"), Text(record, "device_time"),
      clock < kClocks.size() ? std::string(kClocks[clock]) : std::to_string(clock),
      Text(record, "line") + "." + Text(record, "device"), Text(record, "channel"),
      Text(record, "code"), Text(record, "state"), Text(record, "text"));
  row.erase(row.find_last_not_of(" \n") + 1);
  return row + "\n";
}

/// RFC 4180, and no cell that a spreadsheet takes for a formula.
std::string Cell(std::string text) {
  if (!text.empty() && std::string_view("=+-@").find(text.front()) != std::string_view::npos) {
    text.insert(0, "'");
  }
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// Prints the pages of one session.
class Printer {
 public:
  Printer(const EventsOptions& options, std::ostream& out, std::ostream& err)
      : options_(options), out_(out), err_(err) {
    if (options.csv) {
      for (const char* field : kFields) out_ << (field == kFields[0] ? "" : ",") << field;
      out_ << "\r\n";
    }
  }

  void Print(const Json& answer) {
    Tell(answer);
    for (const Json& record : answer.value("records", Json::array())) {
      if (options_.json) {
        out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else if (options_.csv) {
        for (const char* field : kFields) {
          out_ << (field == kFields[0] ? "" : ",") << Cell(Text(record, field));
        }
        out_ << "\r\n";
      } else {
        if (!any_) {
          out_ << fmt::format(kRow, "seq", "received", "time of the device", "its clock", "device",
                              "chan", "code", "state", "text");
        }
        out_ << Row(record);
      }
      any_ = true;
    }
    out_.flush();
  }

  void End() {
    if (any_) return;
    std::ostream& where = options_.json || options_.csv ? err_ : out_;
    const bool all = !options_.since && options_.device.empty() && options_.from <= 1;
    where << (all ? "nothing has happened yet\n" : "nothing of that has happened\n");
  }

 private:
  /// What is wrong with the file, once.
  void Tell(const Json& answer) {
    const auto events = answer.find("events");
    if (events == answer.end() || !events->is_object()) return;
    std::string advice;
    for (const Json& sentence : events->value("advice", Json::array())) {
      if (sentence.is_string()) advice += "baudgate: events: " + sentence.get<std::string>() + "\n";
    }
    const std::string state = Text(*events, "state");
    if (state != told_) err_ << advice;
    told_ = state;
  }

  const EventsOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  std::string told_;
  bool any_ = false;
};

}  // namespace

int RunEvents(const EventsOptions& options, std::ostream& out, std::ostream& err) {
  const StopSignals signals;
  std::optional<Instant> until;
  if (options.seconds) until = ReadClocks().instant + *options.seconds;
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  Json request = {{"command", "events"}, {"after", options.from - 1}};
  if (!options.device.empty()) request["target"] = options.device;
  if (options.since) request["since_ms"] = options.since->time_since_epoch() / 1ms;
  std::optional<Printer> printer;
  for (;;) {
    Json answer;
    if (const int code = ReadAnswer(*client, request, answer, err); code != 0) return code;
    if (!printer) printer.emplace(options, out, err);
    printer->Print(answer);
    if (!out) return 0;  // its reader has left
    request["after"] = answer.value("next", std::int64_t{0});
    if (answer.value("more", false)) continue;
    if (!options.follow) break;
    const Instant next = ReadClocks().instant + kLookAgain;
    std::string line;
    const Got got = client->ReadLine(line, next, signals.descriptor());
    if (got == Got::stopped || (until && next >= *until)) return 0;
    if (got == Got::end) {
      err << "baudgate: the gateway has closed the connection\n";
      return 0;
    }
  }
  printer->End();
  return 0;
}

}  // namespace baudgate
