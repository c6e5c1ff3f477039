// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/one_port.h"

#include <csignal>
#include <thread>

#include "config/loader.h"
#include "config/model/network.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/log.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/daemon/daemon.h"
#include "gateway/lines/line_control.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/operation.h"
#include "gateway/tools/cli/live/run.h"
#include "gateway/tools/cli/offline/make_line.h"

namespace baudgate::tools {
namespace {

constexpr std::size_t kLongestName = 40;

std::string YamlText(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return quoted + "\"";
}

/// Returns the last part of the path as a name. Example: "usb-x" for "/dev/serial/by-id/usb-x".
std::string NameOfPort(const std::string& port) {
  const auto slash = port.find_last_of('/');
  std::string name;
  for (const char c : slash == std::string::npos ? port : port.substr(slash + 1)) {
    const bool word = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (word) {
      name += c;
    } else if (!name.empty() && name.back() != '-') {
      name += '-';
    }
    if (name.size() == kLongestName) break;
  }
  while (name.ends_with('-')) name.pop_back();
  return name.empty() ? "port" : name;
}

/// Loads the configuration made for one port. The error contains all problems, one on each line.
Result<config::Config> PortConfig(const std::string& yaml, const config::Catalog& catalog) {
  config::Loaded loaded = config::LoadText(yaml, "command line", catalog);
  if (loaded.ok()) return std::move(loaded.config);
  std::string all;
  for (const config::Problem& problem : loaded.problems) {
    if (!problem.warning) all += (all.empty() ? "" : "\n") + problem.message;
  }
  return Error{all};
}

constexpr std::uint16_t kUsualPort = 1502;

/// Adds the default port. Example: "0.0.0.0" → "0.0.0.0:1502". Fails for a port without an address.
Result<config::HostPort> Place(const std::string& listen) {
  if (ParseInteger<std::uint16_t>(listen)) {
    return Error{"--listen: " + listen + " is a port without an address; write 127.0.0.1:" +
                 listen + " for this machine alone, or 0.0.0.0:" + listen + " with --allow"};
  }
  const auto place = config::ParseServer(listen, kUsualPort);
  if (!place) return Error{"--listen: " + place.error()};
  if (!config::IsIpAddress(place->host)) {
    return Error{"--listen: " + place->host +
                 " is not an IP address; write an address of this machine, for example "
                 "127.0.0.1"};
  }
  return place;
}

bool IsLocal(const config::HostPort& place) {
  return config::IsLoopback(config::ReachOf(place.host));
}

std::string Yaml(const BridgeOptions& options, const config::HostPort& place,
                 const ScratchDirectory& scratch) {
  std::string serial;
  for (const std::string& word : options.serial) serial += (serial.empty() ? "" : " ") + word;
  std::string allow;
  for (const std::string& network : options.allow) {
    allow += (allow.empty() ? "" : ", ") + YamlText(network);
  }
  const bool bracketed = place.host.find(':') != std::string::npos;
  const std::string at =
      (bracketed ? "[" + place.host + "]" : place.host) + ":" + std::to_string(place.port);
  std::string yaml = "gateway:\n  name: bridge-" + NameOfPort(options.port) + "\n";
  yaml += "  state: " + YamlText((scratch.path() / "state").string()) + "\n";
  yaml += "modbus:\n  listen:\n    - at: " + YamlText(at) + "\n";
  if (!allow.empty()) yaml += "      allow: [" + allow + "]\n";
  if (options.read_only) yaml += "      permit: read\n";
  yaml += "  routes: [ { units: \"1-247\", line: bus } ]\n";
  yaml += "dds: { enabled: false }\n";
  yaml += "lines:\n  - name: bus\n    port: " + YamlText(options.port) + "\n";
  yaml += "    protocol: " + YamlText(options.protocol) + "\n";
  if (!serial.empty()) yaml += "    serial: " + YamlText(serial) + "\n";
  return yaml;
}

}  // namespace

int RunBridge(const BridgeOptions& options, const config::Catalog& catalog, std::ostream& err) {
  const auto place = Place(options.listen);
  if (!place) {
    err << "baudgate: " << place.error() << '\n';
    return kExitUsage;
  }
  if (options.allow.empty() && !IsLocal(*place)) {
    err << "baudgate: --listen " << options.listen
        << " lets everybody write to the bus, because Modbus has no password; limit the clients, "
           "for example with --allow 10.0.0.0/24\n";
    return kExitUsage;
  }
  const ScratchDirectory scratch("bridge");
  if (scratch.path().empty()) {
    err << "baudgate: no temporary folder can be made; set TMPDIR to a writable folder\n";
    return kExitCanNot;
  }
  auto config = PortConfig(Yaml(options, *place, scratch), catalog);
  if (!config) {
    err << "baudgate: " << config.error() << '\n';
    return kExitBadConfiguration;
  }
  return Serve(std::move(*config), std::nullopt, catalog);
}

namespace {

constexpr const char* kLine = "port";
constexpr const char* kDevice = "device";
/// The longest time to wait for the port and for the first readings. After that, the values that
/// were read so far are shown.
constexpr Duration kWaitForPort = 15s;
constexpr Duration kLookAtValuesEvery = 20ms;

Result<std::string> Yaml(const ReadPortOptions& options, const std::string& protocol,
                         const ScratchDirectory& scratch) {
  std::string yaml = "gateway:\n  name: read\n";
  yaml += "  state: " + YamlText((scratch.path() / "state").string()) + "\n";
  yaml += "  socket: " + YamlText((scratch.path() / "control").string()) + "\n";
  yaml += "modbus: { enabled: false }\ndds: { enabled: false }\n";
  yaml +=
      "lines:\n  - name: " + std::string(kLine) + "\n    port: " + YamlText(options.port) + "\n";
  yaml += "    protocol: " + YamlText(protocol) + "\n";
  if (!options.serial.empty()) yaml += "    serial: " + YamlText(options.serial) + "\n";
  yaml += "    devices:\n      - name: " + std::string(kDevice) + "\n";
  if (!options.address.empty()) yaml += "        address: " + YamlText(options.address) + "\n";
  yaml += "        profile: " + YamlText(options.profile) + "\n";
  for (const std::string& option : options.options) {
    const auto equals = option.find('=');
    if (equals == std::string::npos) return Error{"--option: write key=value"};
    yaml += "        " + YamlText(option.substr(0, equals)) + ": " +
            YamlText(option.substr(equals + 1)) + "\n";
  }
  return yaml;
}

/// True if the device has replied, but a point is still waiting to be read: a part of a reply was
/// refused and is requested again in smaller pieces, or the point's request was not sent yet.
bool IsUnderWay(const bus::DeviceRecord& record, Instant now) {
  if (record.status.Count(Outcome::ok) == 0) return false;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const bool read = record.device->points[i].access != config::Access::write;
    if (read && QualityAt(record, i, now) == Quality::bad_waiting) return true;
  }
  return false;
}

/// True if the device was asked, and either has not replied or all its points were read.
bool IsKnown(const bus::PointStore& store) {
  bool known = false;
  store.Read(0, [&](const bus::DeviceRecord& record) {
    const Outcome outcome = record.status.last_outcome;
    const bool asked = outcome != Outcome::none && outcome != Outcome::line_down;
    known = asked && !IsUnderWay(record, ReadClocks().instant);
  });
  return known;
}

int Fail(const std::string& message, int code, std::ostream& err) {
  err << "baudgate: " << message << '\n';
  return code;
}

/// Waits until the port is open and IsKnown is true, at most kWaitForPort. Succeeds if the port is
/// open after that time, even if IsKnown is false. The error tells why the port is not open.
Status AwaitPort(const bus::PointStore& store) {
  const Instant limit = ReadClocks().instant + kWaitForPort;
  while (ReadClocks().instant < limit) {
    const bus::LineStatus line = store.ReadLine(0);
    const bool open = line.port == bus::LineStatus::Port::open;
    if (open && IsKnown(store)) return {};
    const bool tried = !line.port_text.empty() && line.port_text != lines::kNotOpenedYet;
    if (!open && tried) return Error{line.port_text};
    std::this_thread::sleep_for(kLookAtValuesEvery);
  }
  if (store.ReadLine(0).port == bus::LineStatus::Port::open) return {};
  return Error{"the port did not open within " + FormatDuration(kWaitForPort)};
}

struct Traffic {
  int requests = 0;
  std::string request{};  ///< the last request, in hex
  bool anything = false;  ///< true: at least one byte was received
};
Traffic TrafficOf(const std::string& socket, std::ostream& err) {
  Traffic traffic;
  ControlClient::Json recorded;
  if (Ask(socket, {{"command", "recorded"}, {"target", kLine}}, recorded, err) != kExitDone) {
    return traffic;
  }
  for (const auto& record : recorded.value("records", ControlClient::Json::array())) {
    const std::string text = record.get<std::string>();
    traffic.anything = traffic.anything || text.find(" < ") != std::string::npos;
    const auto sent = text.find(" > ");
    if (sent == std::string::npos) continue;
    ++traffic.requests;
    const auto from = sent + 3;
    traffic.request = Trim(text.substr(from, text.find('|', from) - from));
  }
  return traffic;
}

/// Prints why the device could not be read: the request that got no answer, or, if bytes were
/// received, the advice of the status.
void ExplainFailure(const ReadPortOptions& options, const std::string& serial,
                    const std::string& socket, std::ostream& err) {
  const Traffic traffic = TrafficOf(socket, err);
  err << "baudgate: " << options.port << ": ";
  if (traffic.requests > 0 && !traffic.anything) {
    err << traffic.request << " was sent " << traffic.requests << " times"
        << (serial.empty() ? "" : " at " + serial)
        << ", and no byte came back: check the power, the wires"
        << (options.address.empty() ? "" : ", address " + options.address)
        << " and the settings; 'baudgate scan " << options.port << "' tries other settings\n";
    return;
  }
  if (traffic.requests == 0 && !traffic.anything) {
    err << "the device sends by itself, and no byte came within " << FormatDuration(kWaitForPort)
        << (serial.empty() ? "" : " at " + serial)
        << ": check the power, the wires and the settings\n";
    return;
  }
  err << (traffic.requests > 0 ? "some points were not read" : "the device has not sent all points")
      << '\n';
  ControlClient::Json status;
  if (Ask(socket, {{"command", "status"}}, status, err) != kExitDone) return;
  for (const auto& line : status.value("lines", ControlClient::Json::array())) {
    for (const auto& device : line.value("devices", ControlClient::Json::array())) {
      for (const auto& sentence : device.value("advice", ControlClient::Json::array())) {
        err << "baudgate: the device: " << sentence.get<std::string>() << '\n';
      }
    }
  }
}

}  // namespace

int RunReadPort(const ReadPortOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err) {
  signal(SIGPIPE, SIG_IGN);
  log::SetLeast(log::Level::error);
  const ScratchDirectory scratch("read");
  if (scratch.path().empty()) {
    return Fail("no temporary folder can be made; set TMPDIR to a writable folder", kExitCanNot,
                err);
  }
  const auto protocol = options.protocol.empty() ? ProtocolOfProfile(options.profile, catalog)
                                                 : Result<std::string>(options.protocol);
  if (!protocol) return Fail(protocol.error(), kExitBadConfiguration, err);
  const auto yaml = Yaml(options, *protocol, scratch);
  if (!yaml) return Fail(yaml.error(), kExitUsage, err);
  auto config = PortConfig(*yaml, catalog);
  if (!config) return Fail(config.error(), kExitBadConfiguration, err);
  const std::string socket = config->socket;
  const config::Line& line = config->lines.front();
  const std::string serial = line.is_network() ? std::string() : line.serial.ToString();
  daemon::Daemon daemon(std::move(*config), catalog);
  if (const Status started = daemon.Start(); !started) {
    return Fail(started.error(), kExitCanNot, err);
  }
  int code = kExitCanNot;
  const Status open = AwaitPort(daemon.store());
  if (open) {
    std::string target = std::string(kLine) + "." + kDevice;
    if (!options.point.empty()) target += "." + options.point;
    bool unasked = false;
    daemon.store().Read(0,
                        [&](const bus::DeviceRecord& record) { unasked = record.status.unasked; });
    code = RunRead({.target = target,
                    .json = options.json,
                    .socket = socket,
                    .passing = true,
                    .unasked = unasked},
                   out, err);
    if (code == kNotDone) ExplainFailure(options, serial, socket, err);
  } else {
    err << "baudgate: " << options.port << ": " << open.error()
        << "; 'baudgate ports' lists the ports and the programs that use them\n";
  }
  // If Stop fails, a driver is blocked. Destructors would wait for the driver, so they are skipped.
  if (!daemon.Stop()) {
    out.flush();
    std::_Exit(code);
  }
  return code;
}

}  // namespace baudgate::tools
