// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "gateway/base/secret_file.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/outputs/users/user_file.h"
#include "gateway/outputs/web/access.h"
#include "gateway/outputs/web/metrics.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/records/history/folder_files.h"
#include "gateway/tools/terminal/tables.h"
#include "transports/tls_files.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string Megabytes(std::uint64_t bytes) {
  return FormatNumber(std::round(static_cast<double>(bytes) / 1e5) / 10) + " MB";
}

}  // namespace

void PrintEvents(const config::Config& config, std::ostream& out) {
  std::string names = config.events.given ? "the gateway" : "";
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (!device.events && !device.point_events) continue;
      names += (names.empty() ? "" : ", ") + line.name + "." + device.name;
      if (!device.events) names += " (points)";
      bool first = true;
      for (const config::Record& record : device.records) {
        names += (std::exchange(first, false) ? " with " : " and ") + record.name;
      }
    }
  }
  if (names.empty()) return;
  const auto folder = records::EventsFolderOf(config);
  out << "events of " << names;
  if (!folder.empty()) out << ", and a record of every write, in " << folder.string();
  out << '\n';
}

/// Prints which records in the memory of meters the gateway reads. Example: "load profiles of
/// meters.m1 (1, 2), meters.m2 (1)".
void PrintOfMeters(const config::Config& config, std::ostream& out) {
  constexpr std::array<std::pair<const char*, const char*>, 2> kKinds = {
      {{"load_profile", "load profiles of "}, {"billing", "billing readings of "}}};
  for (const auto& [option, title] : kKinds) {
    std::string text;
    for (const config::Line& line : config.lines) {
      for (const config::Device& device : line.devices) {
        if (!device.options.Has(option) || device.options.Texts(option).empty()) continue;
        std::string words;
        for (const std::string& word : device.options.Texts(option)) {
          words += (words.empty() ? "" : ", ") + word;
        }
        text += (text.empty() ? title : ", ") + line.name + "." + device.name + " (" + words + ")";
      }
    }
    if (!text.empty()) out << text << '\n';
  }
}

void PrintHistory(const config::Config& config, std::ostream& out) {
  const config::History& history = config.history;
  if (!history.on()) return;
  const history::Estimate estimate = history::EstimateOf(config);
  const auto folder = records::HistoryFolderOf(config);
  const auto days = [&](std::uint64_t bytes) {
    return Plural(estimate.Days(history.limit, bytes), "day");
  };
  out << "history of " << Plural(history.points.size(), "point");
  if (!folder.empty()) out << " in " << folder.string();
  out << ": about " << Megabytes(estimate.least) << " a day while nothing changes, at most "
      << Megabytes(estimate.most) << ", and " << Megabytes(estimate.minutes)
      << " for the means of each minute; the limit of " << Megabytes(history.limit)
      << " is reached after " << days(estimate.least) << ", or " << days(estimate.most)
      << " if every reading differs; "
      << "days older than " << FormatDuration(history.keep) << " are deleted\n";
}

void PrintOutlets(const config::Config& config, std::ostream& out) {
  const config::History& history = config.history;
  if (!config.remote_write.on || !history.on()) return;
  const history::Estimate estimate = history::EstimateOf(config);
  const auto days = [&](std::uint64_t bytes_a_day) {
    const auto kept = static_cast<std::uint64_t>(history.keep / 24h);
    return Plural(std::min(estimate.Days(history.limit, bytes_a_day), kept), "day");
  };
  out << "remote write to " << config.remote_write.url
      << ": while the receiver is away, values wait in the history for " << days(estimate.most)
      << " if every reading differs, and for " << days(estimate.least)
      << " if nothing changes; older values are lost\n";
}

Json HistoryJson(const config::Config& config) {
  if (!config.history.on()) return {};
  const history::Estimate estimate = history::EstimateOf(config);
  return {{"points", config.history.points.size()},
          {"limit", config.history.limit},
          {"bytes_a_day_least", estimate.least},
          {"bytes_a_day_most", estimate.most},
          {"bytes_of_minutes", estimate.minutes},
          {"days_least", estimate.Days(config.history.limit, estimate.most)},
          {"days_most", estimate.Days(config.history.limit, estimate.least)}};
}

namespace {

constexpr std::size_t kMostNamed = 8;

/// Returns the first names and the number of further names. Example: "a, b, c and 4 more".
std::string Listed(const std::vector<std::string>& all) {
  std::string text;
  for (std::size_t i = 0; i < all.size() && i < kMostNamed; ++i) {
    text += (i == 0 ? "" : ", ") + all[i];
  }
  if (all.size() > kMostNamed) text += " and " + std::to_string(all.size() - kMostNamed) + " more";
  return text;
}

std::string ListedWithRules(const std::vector<std::string>& ruled,
                            const std::vector<std::string>& plain) {
  std::string text;
  for (const std::string& one : ruled) text += (text.empty() ? "" : ", ") + one;
  if (plain.empty()) return text;
  return text + (text.empty() ? "" : ", ") + Listed(plain);
}

/// Returns the rules for writing the point, such as " (0.5 to 40 xIn, selected first)"; empty: the
/// point has no rules.
std::string Rules(const config::Point& point) {
  const config::Writing& writing = point.writing;
  std::vector<std::string> rules;
  const std::string unit = point.unit.empty() ? "" : " " + point.unit;
  const std::string min = writing.min ? writing.min->ToText() + unit : *writing.min_point;
  const std::string max = writing.max ? writing.max->ToText() + unit : *writing.max_point;
  if (writing.min && writing.max) {
    rules.push_back(writing.min->ToText() + " to " + max);
  } else if (!min.empty() && !max.empty()) {
    rules.push_back(min + " to " + max);
  } else if (!min.empty()) {
    rules.push_back("from " + min);
  } else if (!max.empty()) {
    rules.push_back("to " + max);
  }
  if (writing.step) rules.push_back("steps of " + writing.step->ToText());
  if (writing.select) rules.emplace_back("selected first");
  for (const config::AllowWhen& interlock : writing.allow_when) {
    rules.push_back("when " + interlock.point + " is " + ToText(interlock.is));
  }
  return rules.empty() ? "" : " (" + Listed(rules) + ")";
}

struct WriteRules {
  std::vector<std::string> allowed;
  std::vector<std::string> ruled;  ///< allowed points with rules, each followed by its rules
  std::vector<std::string> plain;  ///< allowed points without rules
  std::vector<std::string> off;
};

WriteRules WritesOf(const config::Device& device) {
  WriteRules writes;
  for (const config::Point& point : device.points) {
    if (point.writing.allowed) {
      const std::string rules = Rules(point);
      writes.allowed.push_back(point.name);
      (rules.empty() ? writes.plain : writes.ruled).push_back(point.name + rules);
    } else if (point.access != config::Access::read) {
      writes.off.push_back(point.name);
    }
  }
  return writes;
}

}  // namespace

void PrintWrites(const config::Line& line, std::ostream& out) {
  for (const config::Device& device : line.devices) {
    const WriteRules writes = WritesOf(device);
    if (writes.allowed.empty() && writes.off.empty()) continue;
    out << "  writes to " << device.name << ": "
        << (writes.allowed.empty() ? "none" : ListedWithRules(writes.ruled, writes.plain));
    if (!writes.off.empty()) {
      out << "; " << Listed(writes.off)
          << " can be written if you add 'write: allow', or a list of "
          << "points, to the device";
    }
    out << '\n';
  }
}

nlohmann::ordered_json WritesJson(const config::Device& device) {
  const WriteRules writes = WritesOf(device);
  return {{"allowed", writes.allowed}, {"off", writes.off}};
}

namespace {

/// Returns what is wrong with the users file; empty: nothing.
std::string WrongUsers(const std::string& file) {
  const auto users = users::UserFile::Read(file);
  if (!users) return users.error();
  if (!users->users().empty()) return {};
  return file + " has no users; add one: baudgate users add NAME --role engineer";
}

/// Returns what is wrong with the files of TLS; empty: nothing.
std::string WrongCertificate(const config::TlsFiles& files, WallTime now) {
  const auto tls = tls::ReadTls(files);
  return tls ? tls::EndsSoon(*tls, now) : tls.error();
}

}  // namespace

void CheckSecurityFiles(const config::Config& config, WallTime now,
                        std::vector<config::Problem>& problems) {
  const auto add = [&problems](const config::Mark& mark, const char* key, const std::string& what) {
    if (!what.empty()) problems.push_back({mark, key + (": " + what), true});
  };
  const config::Web& web = config.web;
  if (web.on && !web.token_file.empty()) {
    const auto token = web::ReadToken(web.token_file);
    add(web.token_mark, "file", token ? std::string() : token.error());
  }
  const auto add_password = [&add](const std::string& file, const config::Mark& mark) {
    if (file.empty()) return;
    const auto password = ReadSecretFile("the password file", file);
    add(mark, "file", password ? std::string() : password.error());
  };
  if (config.mqtt.on) add_password(config.mqtt.password_file, config.mqtt.password_mark);
  if (config.remote_write.on) {
    add_password(config.remote_write.password_file, config.remote_write.password_mark);
  }
  for (const config::TlsUse& use : config::TlsUses(config)) {
    add(use.mark, use.where.c_str(), WrongCertificate(use.files, now));
  }
  if (!config.users.file.empty()) add(config.users.mark, "file", WrongUsers(config.users.file));
}

void PrintMqtt(const config::Config& config, std::ostream& out) {
  const config::Mqtt& mqtt = config.mqtt;
  if (!mqtt.on) return;
  out << "mqtt ";
  for (std::size_t i = 0; i < mqtt.brokers.size(); ++i) {
    out << (i == 0 ? "" : " or ") << mqtt.brokers[i].Address();
  }
  out << " as " << mqtt.client << ", " << config::Name(mqtt.payload) << " to ";
  if (mqtt.payload == config::Mqtt::Payload::sparkplug) {
    out << "the group " << mqtt.prefix;
  } else {
    out << mqtt.topic << " with the prefix " << mqtt.prefix;
  }
  out << (mqtt.commands ? "; clients of the broker may write\n" : "\n");
}

void PrintWeb(const config::Config& config, std::ostream& out) {
  const config::Web& web = config.web;
  if (!web.on) {
    out << "web off\n";
    return;
  }
  out << (web.tls.certificate.empty() ? "web http://" : "web https://") << web.Address() << "/, ";
  out << (web.token_file.empty() ? "without a token" : "with the token of " + web.token_file);
  if (!config.users.file.empty()) out << ", with the users of " << config.users.file;
  for (std::size_t i = 0; i < web.allow.size(); ++i) {
    out << (i == 0 ? ", for " : ", ") << web.allow[i].text;
  }
  if (web.allow.empty()) out << ", for everybody who can connect";
  if (web.acknowledge) out << "; alarms may be acknowledged";
  out << "\n  metrics    at most " << web::SeriesOf(config) << " series\n";
}

nlohmann::ordered_json WebJson(const config::Config& config) {
  if (!config.web.on) return nullptr;
  return {{"listen", config.web.Address()},
          {"token", !config.web.token_file.empty()},
          {"series", web::SeriesOf(config)}};
}

namespace {

using config::Listener;
using config::Route;
using config::UnitSet;
using config::UnitsText;
using Rows = std::vector<UnitRow>;

std::string Numbered(const std::string& word, const UnitSet& units) {
  return word + (units.count() == 1 ? " " : "s ") + UnitsText(units);
}

void AddDevices(const config::Config& config, Rows& rows) {
  std::map<std::uint8_t, UnitRow> by_unit;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (!device.unit) continue;
      by_unit[*device.unit] = {std::to_string(*device.unit),
                               "device " + device.name + " on line " + line.name +
                                   (device.enabled ? " (cached)" : " (cached, disabled)"),
                               ""};
    }
  }
  for (const auto& [unit, row] : by_unit) rows.push_back(row);
}

template <typename Predicate>
std::vector<std::string> PlacesOf(const config::Modbus& modbus, Predicate predicate) {
  std::vector<std::string> places;
  for (const Listener& listener : modbus.listen) {
    if (predicate(listener)) places.push_back(listener.Address());
  }
  return places;
}

/// Returns the listeners that pass on writes to unit 0, even if no route contains unit 0.
std::vector<std::string> Passing(const config::Modbus& modbus) {
  return PlacesOf(modbus, [](const Listener& listener) {
    return listener.broadcast == Listener::Broadcast::pass;
  });
}

/// True if writes to unit 0 go to all slaves of the route's line. The gateway itself still answers
/// reads of unit 0.
bool IsBroadcast(const Route& route) {
  return route.first == 0 && !route.remap && !route.line.empty();
}

void AddRoute(const config::Modbus& modbus, const Route& route, UnitSet units, Rows& rows) {
  const std::string deadline = FormatDuration(route.deadline);
  if (units[0] && IsBroadcast(route)) {
    const bool passed = !Passing(modbus).empty();
    rows.push_back({"0 (writes)",
                    route.Target() + ", all slaves, without an answer" +
                        (passed ? "" : "; not sent, because no listener has broadcast: pass"),
                    deadline});
    units.reset(0);
  }
  if (units.none()) return;
  UnitSet there;
  for (std::size_t unit = 0; unit < units.size(); ++unit) {
    if (units[unit]) there.set(route.SlaveOf(static_cast<std::uint8_t>(unit)));
  }
  const std::string word = route.line.empty() ? "unit" : "slave";
  rows.push_back({UnitsText(units), route.Target() + ", " + Numbered(word, there), deadline});
}

template <typename Texts>
std::string ListOf(const Texts& texts) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : ", ") + text;
  return joined;
}

std::vector<std::string> RoutedLines(const config::Config& config) {
  std::vector<std::string> names;
  for (const Route& route : config.modbus.routes) {
    const bool is_new = std::find(names.begin(), names.end(), route.line) == names.end();
    if (!route.line.empty() && is_new) names.push_back(route.line);
  }
  return names;
}

void AddBroadcasts(const config::Config& config, Rows& rows) {
  const auto lines = RoutedLines(config);
  const auto places = Passing(config.modbus);
  if (lines.empty() || places.empty()) return;
  std::string target = "all slaves of line" + std::string(lines.size() == 1 ? " " : "s ") +
                       ListOf(lines) + ", without an answer";
  if (places.size() < config.modbus.listen.size()) target += " (from " + ListOf(places) + ")";
  rows.push_back({"0 (writes)", std::move(target), ""});
}

std::string OthersGet(const config::Modbus& modbus) {
  const auto silent = PlacesOf(
      modbus, [](const Listener& listener) { return listener.errors == Listener::Errors::silent; });
  if (silent.empty()) return "no device; the client gets exception 0x0A";
  if (silent.size() == modbus.listen.size()) return "no device; the client gets no answer";
  return "no device; the client gets exception 0x0A, but no answer at " + ListOf(silent);
}

}  // namespace

std::vector<UnitRow> UnitRows(const config::Config& config) {
  Rows rows;
  AddDevices(config, rows);
  const auto reached = config::RouteUnits(config);
  UnitSet own = UnitSet().set(0).set(255);
  bool zero_routed = false;
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const Route& route = config.modbus.routes[i];
    AddRoute(config.modbus, route, reached[i], rows);
    zero_routed = zero_routed || reached[i][0];
    UnitSet taken = reached[i];
    if (IsBroadcast(route)) taken.reset(0);
    own &= ~taken;
  }
  if (!zero_routed) AddBroadcasts(config, rows);
  if (own.any()) {
    rows.push_back({UnitsText(own), "the gateway itself: its status from register 9000", ""});
  }
  rows.push_back({"others", OthersGet(config.modbus), ""});
  return rows;
}

void PrintRouteTable(const config::Config& config, std::ostream& out) {
  out << "\nModbus units; the first row that matches a unit applies\n";
  TextTable table({"unit", "goes to", "deadline"});
  for (const UnitRow& row : UnitRows(config)) table.Add({row.units, row.target, row.deadline});
  table.PrintAligned(out, "  ");
}

namespace {

using Json = nlohmann::ordered_json;

std::string_view Describe(config::Permit permit) {
  switch (permit) {
    case config::Permit::read:
      return "reading only (functions 1-4)";
    case config::Permit::data:
      return "reading and writing data (functions 1-6, 15, 16)";
    case config::Permit::all:
      return "reading and writing (all functions)";
  }
  return "";
}

std::string Describe(const config::Listener& listener) {
  std::string text = listener.Address() + ", ";
  if (listener.is_serial()) {
    text += listener.serial.ToString();
    if (listener.serial.software_parity) text += " (software parity)";
    text += ", " + std::string(Title(listener.framing)) + ", ";
  } else {
    text +=
        std::string(Title(listener.framing)) + (listener.speaks_serial() ? " over TCP, " : ", ");
  }
  text += Describe(listener.permit);
  if (listener.is_serial()) return text + ", for the master at this port";
  if (listener.protocol == Listener::Protocol::tls) {
    text += ", with TLS and the rights of the roles " +
            Joined(listener.roles, [](const config::RoleRights& rights) { return rights.role; });
  }
  return text + ", for " + Whom(listener.allow);
}

std::string DescribePriorities(const config::Listener& listener) {
  std::string text;
  for (const config::FunctionPriority& rule : listener.functions) {
    text += std::string(Name(rule.priority)) + " for functions " +
            Joined(rule.codes, [](std::uint8_t code) { return std::to_string(code); }) + "; ";
  }
  for (const config::ClientPriority& rule : listener.clients) {
    text += std::string(Name(rule.priority)) + " for " + rule.from.text + "; ";
  }
  return text + std::string(Name(listener.priority)) + (text.empty() ? " for all" : " for others");
}

Json ToJson(const config::Listener& listener) {
  using config::Listener;
  Json one = {{"at", listener.Address()}};
  one["serial"] = listener.is_serial() ? Json(listener.serial.ToString()) : Json();
  one["framing"] = Name(listener.framing);
  one["permit"] = Name(listener.permit);
  one["priority"] = Name(listener.priority);
  one["priorities"] = DescribePriorities(listener);
  one["errors"] = listener.errors == Listener::Errors::silent ? "silent" : "exception";
  one["broadcast"] = listener.broadcast == Listener::Broadcast::pass ? "pass" : "ignore";
  return one;
}

}  // namespace

void PrintListener(const config::Listener& listener, std::ostream& out) {
  out << "modbus " << Describe(listener) << '\n';
  out << "  priority   " << DescribePriorities(listener) << '\n';
  const bool silent = listener.errors == config::Listener::Errors::silent;
  out << "  errors     "
      << (silent ? "silent: no answer in place of the exceptions 0x06, 0x0A and 0x0B"
                 : "exceptions 0x06, 0x0A and 0x0B are sent")
      << '\n';
  const bool pass = listener.broadcast == config::Listener::Broadcast::pass;
  out << "  broadcast  "
      << (pass ? "passed to all slaves of every line with a route" : "not passed on") << '\n';
  if (listener.is_serial()) return;
  out << "  clients    at most " << listener.max_clients << ", closed after "
      << FormatDuration(listener.idle_timeout) << " without a request\n";
}

Json ModbusJson(const config::Modbus& modbus) {
  Json listeners = Json::array();
  for (const config::Listener& listener : modbus.listen) listeners.push_back(ToJson(listener));
  return {{"enabled", modbus.enabled}, {"listen", std::move(listeners)}};
}

}  // namespace baudgate::tools
