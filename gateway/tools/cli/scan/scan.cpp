// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/scan.h"

#include <fmt/format.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "config/loader.h"
#include "config/profile.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/scan/target.h"
#include "gateway/tools/terminal/tables.h"
#include "transports/tcp_client.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr Duration kDrawEvery = 100ms;
constexpr const char* kStartOfLine = "\r\x1b[K";

std::string TimeLeft(Duration left) {
  const auto seconds = std::chrono::ceil<std::chrono::seconds>(left).count();
  if (seconds < 90) return fmt::format("{} s", seconds);
  return fmt::format("{} min", (seconds + 59) / 60);
}

std::string Joined(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += (text.empty() ? "" : "; ") + sentence;
  return text;
}

Json ToJson(const scan::Found& found, bool network) {
  return {
      {"protocol", found.protocol}, {"serial", network ? Json() : Json(found.serial.ToString())},
      {"address", found.address},   {"identity", found.identity},
      {"profile", found.profile},   {"unit", found.unit},
      {"suspect", found.suspect},   {"remarks", found.remarks}};
}

bool HasUser() { return isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1; }

/// Asks a yes/no question on the terminal. Returns false without a terminal, after Ctrl-C, and
/// after any answer but yes.
bool AskUser(const std::string& question, const StopSignals& stop, std::ostream& err) {
  if (!HasUser()) return false;
  err << question << " [y/N] " << std::flush;
  std::array<pollfd, 2> waited = {pollfd{STDIN_FILENO, POLLIN, 0},
                                  pollfd{stop.descriptor(), POLLIN, 0}};
  if (::poll(waited.data(), waited.size(), -1) < 1 || waited[1].revents != 0) return false;
  char answer[64];
  const ssize_t size = ::read(STDIN_FILENO, answer, sizeof answer);
  return size > 0 && (answer[0] == 'y' || answer[0] == 'Y');
}

}  // namespace

ScanView::ScanView(const ScanOptions& options, bool network, const StopSignals& stop,
                   std::function<void()> alive, std::ostream& out, std::ostream& err)
    : options_(options),
      network_(network),
      stop_(stop),
      alive_(std::move(alive)),
      out_(out),
      err_(err),
      terminal_(isatty(STDERR_FILENO) == 1) {}

void ScanView::Clear() {
  if (std::exchange(drawn_, false)) err_ << kStartOfLine << std::flush;
}

void ScanView::OnProgress(const scan::Progress& progress) {
  alive_();
  const Instant now = ReadClocks().instant;
  if (!terminal_ || now - drawn_at_ < kDrawEvery) return;
  drawn_at_ = now;
  drawn_ = true;
  err_ << kStartOfLine << progress.doing << "; found " << progress.found << "; "
       << TimeLeft(progress.left) << " left; Ctrl-C ends the scan" << std::flush;
}

void ScanView::OnFound(const scan::Found& found) {
  if (options_.json) {
    Clear();
    const Json json = ToJson(found, network_);
    out_ << json.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  } else if (terminal_) {
    Clear();
    err_ << found.protocol << ' ' << found.serial.ToString() << ", address " << found.address
         << ": " << (found.identity.empty() ? "a device" : found.identity) << '\n';
  }
}

bool ScanView::MayTalk(const std::string& who) {
  Clear();
  if (options_.over_traffic) return true;
  const std::string why = who + "; a scan disturbs this traffic";
  if (AskUser("baudgate: " + why + ". Scan anyway?", stop_, err_)) return true;
  refused_ = true;
  if (!HasUser()) {
    err_ << "baudgate: " << options_.target << ": " << why
         << "; disconnect the other sender, or add --over-traffic\n";
  }
  return false;
}

void ScanView::Conclude(const scan::Report& report) {
  Clear();
  if (refused_ && report.found.empty()) return;
  if (!options_.json && report.found.empty() && report.asked) {
    out_ << "No device has answered. Check the adapter ('baudgate ports'), swap A and B, check "
            "that the bus is powered.\n";
  }
  if (!options_.json && !report.found.empty()) {
    TextTable table({"protocol", "serial", "address", "identity", "profile", "unit", "remarks"});
    for (const scan::Found& found : report.found) {
      table.Add({found.protocol, network_ ? "" : found.serial.ToString(),
                 std::to_string(found.address), found.identity,
                 found.profile + (found.assumed ? " (assumed)" : ""), std::to_string(found.unit),
                 Joined(found.remarks)});
    }
    table.PrintAligned(out_, "", options_.width);
  }
  std::ostream& words = options_.json ? err_ : out_;
  for (const std::string& remark : report.remarks) {
    words << WrapSentence(remark + ".", options_.width);
  }
  if (!report.asked && !refused_) {
    words << (report.ended
                  ? "No request was sent, because no protocol uses the addresses in --addresses.\n"
                  : "The scan ended before the first request, while it listened to the line.\n");
  } else if (!report.ended && !refused_) {
    words << "The scan ended before all addresses were asked.\n";
  }
}

namespace {

constexpr Duration kLastAnswer = 1s;

std::string PortOf(const std::string& target) {
  return config::IsNetworkPort(target)
             ? target
             : std::filesystem::absolute(target).lexically_normal().string();
}

Result<scan::Wish> WishOf(const ScanOptions& options, const config::Catalog& catalog) {
  scan::Wish wish;
  wish.addresses = options.addresses;
  wish.quick = options.quick;
  if (const Status any = catalog.HasProtocols(); !any) return Error{any.error()};
  if (!options.protocol.empty()) {
    const auto protocol = catalog.NeedProtocol(options.protocol);
    if (!protocol) return Error{"--protocol: " + protocol.error()};
    if ((*protocol)->scan == nullptr) {
      return Error{"--protocol: a scan cannot find devices of protocol " + options.protocol};
    }
    wish.tongues.push_back(scan::TongueOf(**protocol));
    return wish;
  }
  // Questions of a protocol with ScanRule::never_at can be writes for devices of the protocol that
  // never_at names. These devices must be found first, so that they get no such question.
  for (const bool first : {true, false}) {
    for (const auto& [name, protocol] : catalog.protocols) {
      if (protocol->scan == nullptr || protocol->scan->never_at.empty() != first) continue;
      wish.tongues.push_back(scan::TongueOf(*protocol));
    }
  }
  return wish;
}

scan::ProfileNames NamesOf(const scan::Wish& wish, const config::Catalog& catalog) {
  scan::ProfileNames names;
  for (const scan::Tongue& tongue : wish.tongues) {
    names[std::string(tongue.protocol->name)] = config::NamesAndTitles(catalog, *tongue.protocol);
  }
  return names;
}

/// True if the result of the scan can be written. Called before the scan. Asks the user before an
/// existing file is overwritten.
bool MayWrite(const ScanOptions& options, const StopSignals& stop, std::ostream& err) {
  if (options.config.empty()) return true;
  const auto folder = std::filesystem::absolute(options.config).parent_path();
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    err << "baudgate: cannot write to " << folder.string() << ": " << std::strerror(errno) << '\n';
    return false;
  }
  if (options.force || access(options.config.c_str(), F_OK) != 0) return true;
  if (AskUser("baudgate: " + options.config + " exists. Overwrite it?", stop, err)) return true;
  err << "baudgate: " << options.config
      << " exists; choose another file, or overwrite it with --force\n";
  return false;
}

/// Returns a gateway name made from the host name, because gateway names must be unique in a
/// network.
std::string NameOfThisMachine() {
  char host[HOST_NAME_MAX + 1] = {};
  return scan::GatewayName(::gethostname(host, sizeof host - 1) == 0 ? host : "");
}

int WriteConfig(const ScanOptions& options, const scan::Report& report, const std::string& port,
                const config::Catalog& catalog, std::ostream& err) {
  const scan::Heading heading{.written = "What 'baudgate scan " + options.target + "' has found, " +
                                         FormatWallTime(ReadClocks().wall).substr(0, 19) + "Z.",
                              .gateway = NameOfThisMachine(),
                              .line = IsPort(options.target) ? "bus" : options.target,
                              .port = port};
  const std::string text = scan::Configuration(report, heading);
  const config::Loaded loaded = config::LoadText(text, options.config, catalog);
  for (const config::Problem& problem : loaded.problems) {
    if (!problem.warning) err << problem.mark.ToString() << ": " << problem.message << '\n';
  }
  if (const int error = WriteWhole(options.config, text); error != 0) {
    err << "baudgate: cannot write " << options.config << ": " << std::strerror(error) << '\n';
    return kExitCanNot;
  }
  err << "Wrote " << options.config << "; try it with 'baudgate run -c " << options.config << "'\n";
  return loaded.ok() ? kExitDone : kExitBadConfiguration;
}

}  // namespace

int RunScan(const ScanOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err) {
  auto wish = WishOf(options, catalog);
  if (!wish) {
    err << "baudgate: " << wish.error() << '\n';
    return kExitUsage;
  }
  if (const Status target = CheckTarget(options.target); !target) {
    err << "baudgate: scan: " << target.error() << '\n';
    return kExitUsage;
  }
  // The process must return a lent line before it ends. SIGPIPE would end it at once if the program
  // that reads the output closes it.
  signal(SIGPIPE, SIG_IGN);
  const StopSignals stop;
  if (!MayWrite(options, stop, err)) return kExitCanNot;
  std::unique_ptr<LineLoan> loan;
  if (!IsPort(options.target)) {
    int code = kExitDone;
    loan = LineLoan::Take(options.target, options.socket, err, code);
    if (!loan) return code;
  }
  const std::string port = loan ? loan->port() : PortOf(options.target);
  wish->network = config::IsNetworkPort(port);
  config::SerialSettings first;  // the scan applies the settings of each protocol later
  first.rs485.enabled = options.rs485;
  auto wire = PortWire::Open(port, first, stop);
  if (!wire) {
    err << "baudgate: " << wire.error() << '\n';
    return kExitCanNot;
  }
  // A device may still reply to the gateway's last request.
  if (loan) (*wire)->Listen(kLastAnswer);
  const auto alive = [&loan] {
    if (loan) loan->Renew(ReadClocks().instant);
  };
  ScanView view(options, wish->network, stop, alive, out, err);
  const scan::ProfileNames names = NamesOf(*wish, catalog);
  scan::Scanner scanner(*wish, names, **wire, view);
  const Status end = scanner.Run();
  wire->reset();
  loan.reset();
  view.Conclude(scanner.report());
  int code = view.was_refused() ? kExitCanNot : kExitDone;
  if (!end) {
    err << "baudgate: " << end.error() << '\n';
    code = kExitCanNot;
  }
  if (options.config.empty() || view.was_refused()) return code;
  if (scanner.report().found.empty()) {
    err << "baudgate: " << options.config << " was not written, because no device was found\n";
    return kExitCanNot;
  }
  const int written = WriteConfig(options, scanner.report(), port, catalog, err);
  return code == kExitDone ? written : code;
}

}  // namespace baudgate::tools
