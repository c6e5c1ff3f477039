// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/trace.h"

#include <algorithm>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/decode/exchange_decoder.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/offline/decode.h"
#include "gateway/tools/terminal/command_end.h"

namespace baudgate::tools {
namespace {

using Json = ControlClient::Json;
using Got = ControlClient::Got;

/// Prints decoded frames or, with the option `bytes`, each arrival of bytes. Flushes each line, for
/// use in pipes.
class TracePrinter {
 public:
  TracePrinter(const TraceOptions& options, const Json& answer, const config::Catalog& catalog,
               std::ostream& out)
      : out_(out) {
    std::vector<std::string> head;
    for (const Json& line : answer.value("head", Json::array())) {
      if (!line.is_string()) continue;
      head.push_back(Harmless(line.get<std::string>()));
      const auto device = records::ReadTracedDevice(head.back());
      if (device && !options.device.empty() && device->name != options.device) continue;
      out_ << head.back() << '\n';
    }
    out_.flush();
    if (!options.bytes) frames_.emplace(DecodersOf(head, catalog));
  }

  void Print(const std::string& record) {
    if (!frames_) {
      out_ << record << std::endl;
    } else {
      Print(frames_->Take(record));
    }
  }
  bool waits() const { return frames_ && frames_->waits(); }
  void Flush() {
    if (frames_) Print(frames_->Flush());
  }

 private:
  void Print(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) out_ << line << std::endl;
  }

  std::ostream& out_;
  std::optional<diagnosis::FrameLines> frames_;
};

int PrintRecorded(const Json& answer, const TraceOptions& options, TracePrinter& printer,
                  std::ostream& err) {
  const Json records = answer.value("records", Json::array());
  for (const Json& record : records) {
    if (record.is_string()) printer.Print(record.get<std::string>());
  }
  printer.Flush();
  if (records.empty()) err << "baudgate: " << options.line << ": no frames are recorded yet\n";
  return 0;
}

/// Returns when to stop waiting for the next record: at `until`, or soon if the printer has
/// received bytes, because a pause may show that they are a whole frame.
std::optional<Instant> NextLook(std::optional<Instant> until, const TracePrinter& printer) {
  if (!printer.waits()) return until;
  const Instant soon = ReadClocks().instant + 2 * diagnosis::kApart;
  return until ? std::min(*until, soon) : soon;
}

}  // namespace

int RunTrace(const TraceOptions& options, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err) {
  const StopSignals signals;
  std::optional<Instant> until;
  if (options.seconds) until = ReadClocks().instant + *options.seconds;
  auto client = ConnectOrTell(options.socket, err);
  if (!client) return kNoDaemon;
  Json request = {{"command", options.last ? "recorded" : "trace"}, {"target", options.line}};
  if (!options.device.empty()) request["device"] = options.device;
  Json answer;
  if (const int code = ReadAnswer(*client, request, answer, err); code != 0) return code;
  TracePrinter printer(options, answer, catalog, out);
  if (options.last) return PrintRecorded(answer, options, printer, err);

  std::string why = "the gateway has closed the connection";
  for (std::string line;;) {
    const Got got = client->ReadLine(line, NextLook(until, printer), signals.descriptor());
    if (got != Got::line) printer.Flush();
    if (got == Got::timeout && (!until || ReadClocks().instant < *until)) continue;
    if (got == Got::stopped || got == Got::timeout) return 0;
    if (got == Got::end) break;
    const Json json = Json::parse(line, nullptr, false);
    if (json.contains("end")) why = json.value("end", why);
    if (json.contains("record")) printer.Print(json.value("record", ""));
    if (!out) return 0;  // the program that reads the output has closed it
  }
  err << "baudgate: the trace has ended: " << why << '\n';
  return kNoDaemon;
}

}  // namespace baudgate::tools
