// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/scan.h"

#include <limits.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>

#include "config/identity.h"
#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/scan/line_loan.h"
#include "gateway/tools/cli/scan/port_wire.h"
#include "gateway/tools/cli/scan/scan_view.h"
#include "gateway/tools/cli/scan/target.h"
#include "transports/tcp_address.h"

namespace baudgate {
namespace {

constexpr Duration kLastAnswer = 1s;

/// As a configuration wants it.
std::string PortOf(const std::string& target) {
  return IsTcpPort(target) ? target : std::filesystem::absolute(target).lexically_normal().string();
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
      return Error{"--protocol: devices that speak " + options.protocol + " cannot be looked for"};
    }
    wish.tongues.push_back(scan::TongueOf(**protocol));
    return wish;
  }
  // Those come first whose frames others must not send.
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

/// Before anything is sent: what was found should not be lost for a file that was there.
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

/// Unique among the gateways of a network, where machines are.
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
  // A reader of the output that leaves does not end it: a lent line has to be taken back.
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
  wish->network = IsTcpPort(port);
  config::SerialSettings first;  // any port does it
  first.rs485.enabled = options.rs485;
  auto wire = PortWire::Open(port, first, stop);
  if (!wire) {
    err << "baudgate: " << wire.error() << '\n';
    return kExitCanNot;
  }
  // The gateway's last question may still be answered.
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
    err << "baudgate: " << options.config << " was not written: there is nothing to put into it\n";
    return kExitCanNot;
  }
  const int written = WriteConfig(options, scanner.report(), port, catalog, err);
  return code == kExitDone ? written : code;
}

}  // namespace baudgate
