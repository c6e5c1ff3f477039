// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/client/trace.h"

#include "gateway/cli/client/control_client.h"
#include "gateway/cli/terminal/stop_signals.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;
using Got = ControlClient::Got;

int PrintRecorded(const Json& answer, const TraceOptions& options, std::ostream& out,
                  std::ostream& err) {
  const Json records = answer.value("records", Json::array());
  for (const Json& record : records) {
    if (record.is_string()) out << record.get<std::string>() << '\n';
  }
  out.flush();
  if (records.empty()) err << "baudgate: " << options.line << ": nothing is recorded yet\n";
  return 0;
}

}  // namespace

int RunTrace(const TraceOptions& options, std::ostream& out, std::ostream& err) {
  const StopSignals signals;
  std::optional<Instant> until;
  if (options.seconds) until = ReadClocks().instant + *options.seconds;
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  Json request = {{"command", options.last ? "recorded" : "trace"}, {"target", options.line}};
  if (!options.device.empty()) request["device"] = options.device;
  Json answer;
  if (const int code = ReadAnswer(*client, request, answer, err); code != 0) return code;
  if (options.last) return PrintRecorded(answer, options, out, err);

  std::string why = "the gateway has closed the connection";
  for (std::string line;;) {
    const Got got = client->ReadLine(line, until, signals.descriptor());
    if (got == Got::stopped || got == Got::timeout) return 0;
    if (got == Got::end) break;
    const Json json = Json::parse(line, nullptr, false);
    if (json.contains("end")) why = json.value("end", why);
    if (json.contains("record")) out << json.value("record", "") << std::endl;
    if (!out) return 0;  // its reader has left
  }
  err << "baudgate: the trace has ended: " << why << '\n';
  return kNoDaemon;
}

}  // namespace baudgate
