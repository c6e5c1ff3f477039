// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/ports/ports.h"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <tuple>

#include "gateway/base/shown.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/traffic_view.h"
#include "gateway/tools/terminal/tables.h"
#include "transports/serial_port.h"

namespace baudgate::tools {
namespace {

namespace fs = std::filesystem;

/// How many folders of /sys are searched, from a port's folder upwards; higher folders are hubs.
constexpr int kMostLevels = 6;
constexpr int kMostLinks = 8;

/// Returns the first line of a file in printable form: a device's texts can contain any bytes.
std::string ReadText(const fs::path& file) {
  std::ifstream stream(file);
  std::string text;
  std::getline(stream, text);
  return Harmless(text);
}

/// Returns the name of the port's driver. Since Linux 6.5, two devices of serial-base, "port" and
/// "ctrl", are between a port and its driver.
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

/// False if the port's `type` is 0: the board has an address for the port, but no hardware.
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

/// True for a link that names the USB socket or slot of the adapter. If two adapters have the same
/// serial number, only such links are unique.
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

/// Returns a key that sorts numbers by value: ttyS2 comes before ttyS10.
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

namespace {

constexpr char kServiceUser[] = "baudgate";
constexpr mode_t kReadWrite = 06;
constexpr int kMostGroups = 256;

std::vector<gid_t> GroupsOf(const std::string& name, gid_t first) {
  std::vector<gid_t> groups(kMostGroups);
  int count = kMostGroups;
  if (::getgrouplist(name.c_str(), first, groups.data(), &count) < 0) count = kMostGroups;
  groups.resize(static_cast<std::size_t>(count));
  return groups;
}

/// Returns the groups of this process. If the user has joined another group, the user must log in
/// again before this list contains the group.
std::vector<gid_t> OwnGroups() {
  std::vector<gid_t> groups(kMostGroups);
  const int count = ::getgroups(kMostGroups, groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  groups.push_back(::getegid());
  return groups;
}

std::optional<PortFile> ReadPortFile(const std::filesystem::path& root, const std::string& path) {
  struct stat info {};
  const std::string at = root / std::filesystem::path(path).relative_path();
  if (::stat(at.c_str(), &info) != 0) return std::nullopt;
  const struct ::group* entry = ::getgrgid(info.st_gid);
  return PortFile{path, info.st_uid, info.st_gid,
                  entry != nullptr ? entry->gr_name : std::to_string(info.st_gid), info.st_mode};
}

/// Returns the user of this process and, if it exists on this machine, the user of the service.
std::vector<Person> PeopleHere() {
  std::vector<Person> people;
  people.push_back({NameOfUser(::geteuid()), ::geteuid(), OwnGroups(), false});
  const struct ::passwd* service = ::getpwnam(kServiceUser);
  if (service == nullptr || service->pw_uid == ::geteuid()) return people;
  people.push_back({kServiceUser, service->pw_uid, GroupsOf(kServiceUser, service->pw_gid), true});
  return people;
}

}  // namespace

/// Decides like the kernel: of owner, group and others, the first that fits the person determines
/// the access.
bool MayUse(const Person& person, const PortFile& file) {
  if (person.id == 0) return true;
  unsigned shift = 0;
  if (person.id == file.owner) {
    shift = 6;
  } else if (std::ranges::find(person.groups, file.group) != person.groups.end()) {
    shift = 3;
  }
  return ((file.mode >> shift) & kReadWrite) == kReadWrite;
}

std::string HowToMend(const Person& person, const PortFile& file) {
  const std::string who =
      person.is_service ? "the service (user baudgate)" : "you (" + person.name + ")";
  const std::string head = fmt::format("{} may not open {}; run: ", who, file.path);
  if (!transports::IsGroupForPorts(file.group, file.mode))
    return head + transports::HowToGive(file.path);
  if (person.is_service) {
    return head + fmt::format(
                      "sudo systemctl edit baudgate, with [Service] and "
                      "SupplementaryGroups={}, then sudo systemctl restart baudgate",
                      file.group_name);
  }
  return head +
         fmt::format("sudo usermod -aG {} {}, then log in again", file.group_name, person.name);
}

namespace {

using Json = nlohmann::ordered_json;

constexpr char kNoPorts[] =
    "This machine has no serial port. Plug an adapter in (if none appears, see `sudo dmesg | "
    "tail`), or use a serial server in the network: port: tcp://HOST:PORT.\n";
/// Recommended latency of an FTDI adapter, in ms. Its default, 16 ms, is long between two frames.
constexpr int kShortLatency = 1;

struct Row {
  FoundPort port;
  std::vector<std::string> held_by;
  bool ours = false;  ///< true: the gateway has opened the port
  Json modem;         ///< control lines of a port that the gateway uses; null: unknown
  std::vector<std::string> advice;
};

Json Gateway(const PortsPlace& place) { return place.status ? place.status() : Json(); }

/// If the gateway uses the port, adds this use to `row.held_by`. Example: "line bay of substation-7
/// (open: DTR RTS CTS)".
void AddOurs(const PortsPlace& place, const Json& status, Row& row) {
  const std::string gateway = status.value("gateway", "the gateway");
  const auto add = [&](const Json& user, const std::string& what) {
    if (PortNameOf(place.root, user.value("port", "")) != row.port.name) return;
    const std::string state = user.value("port_state", "");
    const std::string lines = ControlLinesText(user.value("modem", Json()));
    row.held_by.push_back(
        fmt::format("{} of {} ({}{})", what, gateway, state, lines.empty() ? "" : ": " + lines));
    row.ours = row.ours || state == "open";
    if (user.contains("modem")) row.modem = user.at("modem");
    if (state == "closed") row.advice.push_back(what + ": " + user.value("port_text", ""));
  };
  for (const Json& line : status.value("lines", Json::array())) {
    add(line, "line " + line.value("name", ""));
  }
  const Json modbus = status.value("modbus", Json::object());
  for (const Json& master : modbus.value("masters", Json::array())) add(master, "a Modbus master");
}

void AddPrograms(const PortHolders& holders, Row& row) {
  const auto found = holders.by_port.find(row.port.name);
  if (found == holders.by_port.end()) return;
  for (const PortHolders::Program& program : found->second) {
    if (row.ours && program.name == "baudgate") continue;
    row.held_by.push_back(fmt::format("{} (pid {})", program.name, program.pid));
  }
}

void AddAdvice(const PortsPlace& place, Row& row) {
  const FoundPort& port = row.port;
  if (const auto file = ReadPortFile(place.root, port.path())) {
    for (const Person& person : place.people) {
      if (!MayUse(person, *file)) row.advice.push_back(HowToMend(person, *file));
    }
  }
  if (port.twin) {
    row.advice.push_back(
        fmt::format("another adapter has the same serial number {}; use the name by USB socket "
                    "(/dev/serial/by-path)",
                    port.serial));
  }
  if (port.latency_ms.value_or(0) > kShortLatency && !row.ours) {
    row.advice.push_back(
        fmt::format("the adapter delays bytes by up to {} ms; the gateway switches this off while "
                    "it has the port open (low_latency). For other programs run: echo 1 | sudo tee "
                    "/sys/class/tty/{}/device/latency_timer",
                    *port.latency_ms, port.name));
  }
}

std::vector<Row> Look(const PortsPlace& place, const PortHolders& holders) {
  const Json status = Gateway(place);
  std::vector<Row> rows;
  for (FoundPort& port : FindPorts(place.root)) {
    Row& row = rows.emplace_back(Row{std::move(port), {}, false, {}, {}});
    if (status.is_object()) AddOurs(place, status, row);
    AddPrograms(holders, row);
    AddAdvice(place, row);
  }
  return rows;
}

std::string Joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

Json TextOrNull(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json ToJson(const Row& row) {
  const FoundPort& port = row.port;
  Json usb;
  if (port.is_usb()) {
    usb = {{"at", port.at},
           {"vendor", port.vendor},
           {"product", port.product},
           {"maker", TextOrNull(port.maker)},
           {"model", TextOrNull(port.model)},
           {"serial", TextOrNull(port.serial)},
           {"interface", TextOrNull(port.interface)}};
  }
  return {{"port", port.path()},
          {"driver", TextOrNull(port.driver)},
          {"usb", std::move(usb)},
          {"names", port.links},
          {"latency_ms", port.latency_ms ? Json(*port.latency_ms) : Json(nullptr)},
          {"held_by", row.held_by},
          {"modem", row.modem},
          {"advice", row.advice}};
}

std::string AdapterText(const FoundPort& port) {
  if (!port.is_usb()) return {};
  const std::string name = port.model.empty() ? port.maker : port.model;
  return fmt::format("{}:{}{}{}", port.vendor, port.product, name.empty() ? "" : " ", name);
}

void PrintTable(const std::vector<Row>& rows, std::ostream& out) {
  TextTable table({"port", "driver", "adapter", "held by", "stable name"});
  for (const Row& row : rows) {
    table.Add({row.port.path(), row.port.driver, AdapterText(row.port), Joined(row.held_by),
               row.port.links.empty() ? "" : row.port.links.front()});
  }
  table.PrintAligned(out);
  const char* before = "\n";
  for (const Row& row : rows) {
    for (const std::string& advice : row.advice) {
      out << std::exchange(before, "") << row.port.name << ": " << advice << '\n';
    }
  }
}

}  // namespace

int ShowPorts(bool json, const PortsPlace& place, std::ostream& out) {
  const PortHolders holders = FindHolders(place.root);
  const std::vector<Row> rows = Look(place, holders);
  if (json) {
    Json ports = Json::array();
    for (const Row& row : rows) ports.push_back(ToJson(row));
    const Json all = {{"ports", std::move(ports)}, {"all_holders_seen", holders.all_seen}};
    out << all.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    return 0;
  }
  if (rows.empty()) {
    out << kNoPorts;
    return 0;
  }
  PrintTable(rows, out);
  if (!holders.all_seen) out << "\nTo see programs of other users, run this command with sudo.\n";
  return 0;
}

int RunPorts(const PortsOptions& options, std::ostream& out) {
  PortsPlace place;
  place.people = PeopleHere();
  place.status = [&options] {
    Json status;
    std::ostringstream ignored;  // a missing gateway is not an error
    if (Ask(options.socket, {{"command", "status"}}, status, ignored) != 0) return Json();
    return status;
  };
  return ShowPorts(options.json, place, out);
}

}  // namespace baudgate::tools
