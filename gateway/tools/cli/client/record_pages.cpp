// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/record_pages.h"

#include "gateway/base/shown.h"
#include "gateway/tools/terminal/stop_signals.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;
using Got = ControlClient::Got;

constexpr Duration kLookForRecords = 500ms;

/// What is wrong with the file, each time that its state is another one.
class Troubles {
 public:
  Troubles(std::string key, std::ostream& err) : key_(std::move(key)), err_(err) {}

  /// The state.
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

}  // namespace

std::string FieldText(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return {};
  return Harmless(found->is_string() ? found->get<std::string>() : found->dump());
}

/// A gateway that has only just started may still be opening the file: it is waited for.
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
    if (!out) return 0;  // its reader has left
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

}  // namespace baudgate
