// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan/found.h"

#include <algorithm>
#include <cctype>
#include <tuple>

#include "config/model/modbus.h"
#include "gateway/base/text.h"

namespace baudgate::scan {
namespace {

/// The longest host name (RFC 1035).
constexpr std::size_t kLongestName = 63;

std::string FormatOf(const config::SerialSettings& serial) {
  const std::string text = serial.ToString();
  return text.substr(text.find(' ') + 1);
}

/// The most frequent value of `key`, the first of several.
template <typename Key>
auto MostFrequent(const std::vector<Found>& found, Key key) {
  auto best = key(found.front());
  std::ptrdiff_t most = 0;
  for (const Found& one : found) {
    const auto count =
        std::ranges::count_if(found, [&](const Found& other) { return key(other) == key(one); });
    if (count > most) {
      most = count;
      best = key(one);
    }
  }
  return best;
}

/// A text that stands behind '#' in one line.
std::string Comment(std::string_view text) { return "# " + Printable(ToBytes(text)); }

std::string NameOf(const Found& device, const std::vector<std::string>& taken) {
  std::string base = device.profile.empty() || device.assumed ? device.protocol : device.profile;
  for (char& c : base) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
  }
  const std::string name = base + "-" + std::to_string(device.address);
  for (int more = 2;; ++more) {
    const std::string unique = more == 2 ? name : name + "-" + std::to_string(more - 1);
    if (std::ranges::find(taken, unique) == taken.end()) return unique;
  }
}

std::string DeviceText(const Found& device, const std::string& name, const std::string& protocol,
                       const std::string& serial, bool network) {
  std::string text = "      - name: " + name + "\n";
  const auto add = [&text](const std::string& key, const std::string& value) {
    text += "        " + key + ": " + value + "\n";
  };
  add("address", std::to_string(device.address));
  if (device.protocol != protocol) add("protocol", device.protocol);
  if (!network && device.serial.ToString() != serial) add("serial", device.serial.ToString());
  if (!device.mode.key.empty()) add(std::string(device.mode.key), std::string(device.mode.value));
  if (!device.profile.empty()) add("profile", device.profile);
  if (device.unit != 0) add("unit", std::to_string(device.unit));
  if (device.suspect) add("enabled", "false");
  if (device.profile.empty() && !device.point.empty()) {
    text += "        points:\n          - " + device.point + "\n";
  }
  return text;
}

}  // namespace

unsigned UnitFor(const std::vector<Found>& others, unsigned address) {
  const auto is_free = [&](unsigned unit) {
    return std::ranges::none_of(others, [unit](const Found& one) { return one.unit == unit; });
  };
  if (address >= 1 && address <= config::kLastSlave && is_free(address)) return address;
  for (unsigned unit = 1; unit <= config::kLastSlave; ++unit) {
    if (is_free(unit)) return unit;
  }
  return 0;
}

void RemarkFormats(std::vector<Found>& found) {
  for (Found& one : found) {
    std::map<std::string, int> formats;
    for (const Found& other : found) {
      if (other.protocol == one.protocol && other.serial.baud == one.serial.baud) {
        ++formats[FormatOf(other.serial)];
      }
    }
    const auto usual = std::ranges::max_element(
        formats, [](const auto& a, const auto& b) { return a.second < b.second; });
    const std::string own = FormatOf(one.serial);
    if (usual->first == own || usual->second <= formats[own]) continue;
    one.remarks.push_back("it is set to " + own + ", the others of its protocol to " +
                          usual->first + ": a wrong parity?");
  }
}

std::string GatewayName(std::string_view host) {
  std::string name;
  for (const char c : host.substr(0, host.find('.'))) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      name += c;
    } else if (!name.empty() && std::isalnum(static_cast<unsigned char>(name.back())) != 0) {
      name += c == '_' ? '_' : '-';
    }
  }
  while (!name.empty() && std::isalnum(static_cast<unsigned char>(name.back())) == 0) {
    name.pop_back();
  }
  return name.empty() ? "gateway" : name.substr(0, kLongestName);
}

std::string Configuration(const Report& report, const Heading& heading) {
  std::string text = Comment(heading.written) + "\n";
  for (const std::string& remark : report.remarks) text += Comment(remark) + "\n";
  text += "\ngateway: { name: \"" + heading.gateway + "\" }\n";
  text += "\nmodbus:\n  listen: 127.0.0.1:1502\nweb:\n  listen: 127.0.0.1:8502\n\nlines:\n";
  const auto [protocol, serial] = MostFrequent(report.found, [](const Found& one) {
    return std::tuple(one.protocol, one.serial.ToString());
  });
  text += "  - name: \"" + heading.line + "\"\n    port: " + heading.port + "\n";
  if (!report.network) text += "    serial: " + serial + "\n";
  text += "    protocol: " + protocol + "\n";
  if (report.echo) text += "    echo: strip\n";
  text += "    devices:\n";
  std::vector<std::string> names;
  for (const Found& device : report.found) {
    names.push_back(NameOf(device, names));
    if (!device.identity.empty()) text += "      " + Comment("it says: " + device.identity) + "\n";
    if (device.assumed) {
      text += "      " + Comment("its profile is assumed: it does not say what it is") + "\n";
    }
    for (const std::string& remark : device.remarks) text += "      " + Comment(remark) + "\n";
    text += DeviceText(device, names.back(), protocol, serial, report.network);
  }
  return text;
}

}  // namespace baudgate::scan
