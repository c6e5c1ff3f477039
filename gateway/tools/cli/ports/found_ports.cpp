// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/ports/found_ports.h"

#include <algorithm>
#include <fstream>
#include <tuple>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

/// From port to adapter there are a few folders; further up are hubs.
constexpr int kMostLevels = 6;
constexpr int kMostLinks = 8;

/// What a device says of itself may hold anything.
std::string ReadText(const fs::path& file) {
  std::ifstream stream(file);
  std::string text;
  std::getline(stream, text);
  return Harmless(text);
}

/// serial-base of Linux 6.5 and later puts two devices of its own between port and driver.
std::string DriverOf(fs::path device) {
  for (int level = 0; level < kMostLevels; ++level, device = device.parent_path()) {
    std::error_code error;
    const fs::path driver = fs::read_symlink(device / "driver", error);
    const std::string name = driver.filename().string();
    if (!error && name != "port" && name != "ctrl") return name;
  }
  return {};
}

void ReadAdapter(fs::path device, FoundPort& port) {
  for (int level = 0; level < kMostLevels; ++level, device = device.parent_path()) {
    if (port.interface.empty()) port.interface = ReadText(device / "bInterfaceNumber");
    std::error_code error;
    if (!fs::exists(device / "idVendor", error)) continue;
    port.at = device.filename().string();
    port.vendor = ReadText(device / "idVendor");
    port.product = ReadText(device / "idProduct");
    port.maker = ReadText(device / "manufacturer");
    port.model = ReadText(device / "product");
    port.serial = ReadText(device / "serial");
    return;
  }
  port.interface.clear();
}

/// "type" is 0 of a port that the board has an address for, and nothing behind it.
bool HasHardware(const fs::path& tty) { return ReadText(tty / "type") != "0"; }

std::optional<FoundPort> Look(const fs::path& tty) {
  std::error_code error;
  const fs::path device = fs::canonical(tty / "device", error);
  if (error || !HasHardware(tty)) return std::nullopt;
  FoundPort port;
  port.name = tty.filename().string();
  port.driver = DriverOf(device);
  ReadAdapter(device, port);
  port.latency_ms = ParseInteger<int>(ReadText(device / "latency_timer"));
  return port;
}

/// Those by serial number are not unique where two adapters have the same.
bool IsByPlace(const std::string& link) {
  return link.find("/by-path/") != std::string::npos || link.find("/at-") != std::string::npos;
}

void AddLinks(const fs::path& root, FoundPort& port) {
  for (const char* folder : {"/dev/baudgate", "/dev/serial/by-id", "/dev/serial/by-path"}) {
    std::vector<std::string> links;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(root / (folder + 1), error)) {
      const std::string link = std::string(folder) + "/" + entry.path().filename().string();
      if (PortNameOf(root, link) == port.name) links.push_back(link);
    }
    std::sort(links.begin(), links.end());
    port.links.insert(port.links.end(), links.begin(), links.end());
  }
  std::stable_partition(port.links.begin(), port.links.end(),
                        [](const std::string& link) { return !IsByPlace(link); });
}

auto Identity(const FoundPort& port) {
  return std::tie(port.vendor, port.product, port.serial, port.interface);
}

void MarkTwins(std::vector<FoundPort>& ports) {
  for (FoundPort& port : ports) {
    if (port.serial.empty()) continue;
    port.twin = std::ranges::any_of(ports, [&](const FoundPort& other) {
      return other.at != port.at && Identity(other) == Identity(port);
    });
    if (port.twin) std::erase_if(port.links, [](const auto& link) { return !IsByPlace(link); });
  }
}

/// ttyS2 before ttyS10.
auto Order(const FoundPort& port) {
  const std::size_t digits = port.name.find_last_not_of("0123456789") + 1;
  return std::pair(port.name.substr(0, digits),
                   ParseInteger<std::uint64_t>(port.name.substr(digits)).value_or(0));
}

}  // namespace

std::string PortNameOf(const fs::path& root, const std::string& path) {
  fs::path at = path;
  for (int links = 0; links < kMostLinks; ++links) {
    std::error_code error;
    const fs::path target = fs::read_symlink(root / at.relative_path(), error);
    if (error) break;
    at = (at.parent_path() / target).lexically_normal();
  }
  return at.parent_path() == "/dev" ? at.filename().string() : std::string();
}

std::vector<FoundPort> FindPorts(const fs::path& root) {
  std::vector<FoundPort> ports;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root / "sys/class/tty", error)) {
    if (auto port = Look(entry.path())) ports.push_back(std::move(*port));
  }
  std::sort(ports.begin(), ports.end(),
            [](const FoundPort& a, const FoundPort& b) { return Order(a) < Order(b); });
  for (FoundPort& port : ports) AddLinks(root, port);
  MarkTwins(ports);
  return ports;
}

}  // namespace baudgate
