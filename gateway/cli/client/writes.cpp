// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/client/writes.h"

#include <fmt/format.h>

#include <vector>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/cli/client/control_client.h"
#include "gateway/cli/terminal/stop_signals.h"
#include "gateway/cli/terminal/stream_table.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;
using Got = ControlClient::Got;

constexpr Duration kLookAgain = 500ms;

std::string Text(const Json& record, const char* key) {
  const auto found = record.find(key);
  return found != record.end() && found->is_string() ? Harmless(found->get<std::string>()) : "";
}

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
    text = fmt::format("{} times until {}", count, Text(record, "last_time"));
    const std::string first = ValueText(record, "first");
    if (first != "-") text += ", the first " + first;
  }
  const std::string reason = Text(record, "reason");
  return text.empty() || reason.empty() ? text + reason : text + "; " + reason;
}

StreamTable::Row RowOf(const Json& record) {
  std::string target;
  for (const char* key : {"line", "device", "point"}) {
    const std::string part = Text(record, key);
    if (!part.empty()) target += (target.empty() ? "" : ".") + part;
  }
  const std::string change = ValueText(record, "old") + " -> " + ValueText(record, "new");
  return {Text(record, "time"),    Text(record, "client"), target, change,
          Text(record, "outcome"), Remark(record)};
}

/// Prints the pages of one session, whichever way they are asked for.
class Printer {
 public:
  Printer(const WritesOptions& options, std::ostream& out, std::ostream& err)
      : options_(options), out_(out), err_(err) {}

  /// True: the gateway has only just started, and there is more to come.
  bool Print(const Json& answer) {
    const std::string state = Tell(answer);
    std::vector<StreamTable::Row> rows;
    for (const Json& record : answer.value("records", Json::array())) {
      any_ = true;
      if (options_.json) {
        out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else {
        rows.push_back(RowOf(record));
      }
    }
    table_.Print(rows, out_);
    out_.flush();
    return state == "opening";
  }

  void End() {
    if (any_) return;
    std::ostream& where = options_.json ? err_ : out_;
    where << "nothing has been written" << (options_.since ? " since then" : " yet") << '\n';
  }

 private:
  /// What is wrong with the audit, once. Its state.
  std::string Tell(const Json& answer) {
    const auto audit = answer.find("audit");
    if (audit == answer.end() || !audit->is_object()) return {};
    std::string advice;
    for (const Json& sentence : audit->value("advice", Json::array())) {
      if (sentence.is_string()) advice += "baudgate: audit: " + sentence.get<std::string>() + "\n";
    }
    const std::string state = Text(*audit, "state");
    if (state != told_) err_ << advice;
    return told_ = state;
  }

  const WritesOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  StreamTable table_{{{"time", 24},
                      {"client", 21},
                      {"point", 36},
                      {"old -> new", 20},
                      {"outcome", 8},
                      {"reason"}}};
  std::string told_;
  bool any_ = false;
};

}  // namespace

int RunWrites(const WritesOptions& options, std::ostream& out, std::ostream& err) {
  const StopSignals signals;
  std::optional<Instant> until;
  if (options.seconds) until = ReadClocks().instant + *options.seconds;
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  Json request = {{"command", "writes"}, {"after", 0}};
  if (options.follow) request["order"] = "settled";
  if (options.since) request["since_ms"] = options.since->time_since_epoch() / 1ms;
  Printer printer(options, out, err);
  for (;;) {
    Json answer;
    if (const int code = ReadAnswer(*client, request, answer, err); code != 0) return code;
    const bool opening = printer.Print(answer);
    if (!out) return 0;  // its reader has left
    request["after"] = answer.value("next", std::int64_t{0});
    if (answer.value("more", false)) continue;
    if (!options.follow && !opening) break;
    const Instant next = ReadClocks().instant + kLookAgain;
    std::string line;
    const Got got = client->ReadLine(line, next, signals.descriptor());
    if (got == Got::stopped || (until && next >= *until)) return 0;
    if (got == Got::end) {
      err << "baudgate: the gateway has closed the connection\n";
      return 0;
    }
  }
  printer.End();
  return 0;
}

}  // namespace baudgate
