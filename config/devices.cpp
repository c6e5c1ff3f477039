// SPDX-License-Identifier: Apache-2.0
#include "config/devices.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "config/catalog/option_values.h"
#include "config/checks/device_checks.h"
#include "config/checks/line_checks.h"
#include "config/checks/point_checks.h"
#include "config/events.h"
#include "config/history.h"
#include "config/lines.h"
#include "config/model/modbus.h"
#include "config/points.h"
#include "config/profile.h"
#include "config/writing.h"
#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

constexpr std::size_t kLongestRatioUnit = 16;

struct Ratio {
  Decimal factor = 1;
  std::string unit;
};

/// Reads "400 A" or "10 kV".
std::optional<Ratio> ReadRatio(const Entry& entry, Problems& problems) {
  const auto text = ReadText(entry.value, entry.key, problems);
  if (!text) return std::nullopt;
  const std::string_view trimmed = Trim(*text);
  const auto blank = trimmed.find(' ');
  const auto factor = Decimal::Parse(trimmed.substr(0, blank));
  const std::string_view unit =
      blank == std::string_view::npos ? std::string_view() : Trim(trimmed.substr(blank));
  if (const std::string why = WhyLeadingZero(trimmed); !why.empty()) {
    problems.Error(entry.value.mark(), "ratios: " + Quoted(*text) + " " + why);
    return std::nullopt;
  }
  const bool good = factor && *factor > 0 && !unit.empty() && unit.size() <= kLongestRatioUnit;
  if (good) return Ratio{*factor, std::string(unit)};
  problems.Error(entry.value.mark(),
                 "ratios: " + Quoted(*text) +
                     " is not a number above 0 and a unit of at most 16 bytes; write for example " +
                     entry.key + ": 400 A");
  return std::nullopt;
}

bool IsNumber(const Point& point) {
  return point.type != Type::boolean && point.type != Type::string;
}

constexpr int kMostDecimals = 9;  // the greatest value of the key `precision`

void Apply(const Ratio& ratio, Point& point) {
  point.scale *= ratio.factor;
  point.offset *= ratio.factor;
  point.deadband *= ratio.factor;
  for (auto* number : {&point.jump, &point.writing.min, &point.writing.max, &point.writing.step}) {
    if (*number) **number *= ratio.factor;
  }
  if (point.on_fault.kind == OnFault::Kind::value) point.on_fault.value *= ratio.factor;
  for (PointEvent& event : point.events) {
    event.value *= ratio.factor;
    event.hysteresis *= ratio.factor;
  }
  if (point.precision) {
    // Each tenfold of the value takes away a digit behind the point: 0.01 xIn of 400 A are 4 A.
    const auto places = static_cast<int>(std::floor(std::log10(ratio.factor.ToDouble())));
    point.precision =
        static_cast<std::uint8_t>(std::clamp(*point.precision - places, 0, kMostDecimals));
  }
  point.unit = ratio.unit;
}

/// Applies a device's `ratios`. A ratio gives the value of one unit at this site, and applies to
/// all points with this unit.
///
///     ratios: { xIn: 400 A, xUn: 10 kV }      current_l1, unit xIn, reads 0.52 → 208 A
///
/// All numbers of a point are in its unit without ratios, also where the configuration gives them
/// and the profile gives the unit: `max: 1.2` is 480 A.
/// `device.points` must be complete. Reports a unit that no numeric point has, and a ratio that is
/// not above 0.
void ApplyRatios(MapReader& map, Device& device) {
  const auto node = map.Get("ratios");
  if (!node) return;
  std::vector<std::pair<Point*, Ratio>> found;
  for (const Entry& entry : ReadEntries(*node, "ratios", map.problems())) {
    const auto ratio = ReadRatio(entry, map.problems());
    if (!ratio) continue;
    const std::size_t before = found.size();
    for (Point& point : device.points) {
      if (point.unit == entry.key && IsNumber(point)) found.emplace_back(&point, *ratio);
    }
    if (found.size() > before) continue;
    map.problems().Error(entry.value.mark(), "ratios: no point of '" + device.name +
                                                 "' is a number with unit " + Quoted(entry.key) +
                                                 "; 'baudgate profiles " + device.profile +
                                                 "' shows units");
  }
  for (const auto& [point, ratio] : found) Apply(ratio, *point);
}

constexpr std::size_t kMostPointsOfAll = 100'000;

void ReadAddress(MapReader& map, LineAddresses& addresses, const protocols::Protocol* protocol,
                 Device& device) {
  const auto none = protocol ? protocol->canonical_address("") : Result<std::string>(Error{});
  const auto node = none ? map.Get("address") : map.Need("address", "1");
  if (!node && !none) return;
  const auto address = node ? ReadText(*node, "address", map.problems()) : *none;
  if (!address) return;
  device.address = *address;
  if (const std::string why = WhyLeadingZero(*address); !why.empty()) {
    return map.problems().Error(node->mark(), "address: " + Quoted(*address) + " " + why);
  }
  if (protocol) {
    addresses.Add(device, *protocol, node ? node->mark() : device.mark, map.problems());
  }
}

// Returns null if the device names no profile, or one that cannot be found.
const RawProfile* FindProfile(MapReader& map, const protocols::Protocol* protocol, Device& device,
                              LoadContext& context) {
  const auto node = map.Get("profile");
  if (!node) return nullptr;
  const auto name = ReadText(*node, "profile", context.problems);
  if (!name) return nullptr;
  device.profile = *name;
  if (!protocol) return nullptr;
  const auto path = LocateProfile(*name, *protocol, context.catalog, context.base);
  if (!path) {
    context.problems.Error(node->mark(), "profile: " + path.error());
    return nullptr;
  }
  std::error_code error;
  if (!std::filesystem::is_regular_file(*path, error)) {
    const bool exists = std::filesystem::exists(*path, error);
    context.problems.Error(
        node->mark(),
        exists ? "profile: " + path->string() + " is not a regular file; correct the path"
               : "profile: there is no file " + path->string() + "; correct the path");
    return nullptr;
  }
  const auto real = std::filesystem::weakly_canonical(*path, error);
  const auto key =
      std::make_pair(std::string(protocol->name), error ? path->string() : real.string());
  const auto known = context.profiles.find(key);
  if (known != context.profiles.end()) return &known->second;
  auto profile = ReadProfile(*path, *protocol, context.problems);
  return &context.profiles.emplace(key, std::move(profile)).first->second;
}

/// Reads times, retries and ages of the device. The line's retries and most of its times are not
/// copied to the device, because they apply where the device has none; for the exceptions see
/// MergeDevice. Returns the pace merged from device, profile and line.
Pace ReadTimes(MapReader& map, const Profile& profile, const Pace& line, Device& device) {
  const Pace said = ReadPace(map, Level::device);
  const Pace own = Merge(said, profile.pace);
  CheckPaces({said, profile.pace, line}, device.name, device.mark, map.problems());
  device.timing = MergeDevice(said.timing, profile.pace.timing, line.timing);
  device.retries = own.retries;
  const Pace all = Merge(own, line);
  Assign(device.poll, all.poll);
  Assign(device.slow, all.slow);
  Assign(device.daily, all.daily);
  map.Read<&Device::max_age, &Device::dead_age>(device);
  return all;
}

void ReadModbusSide(MapReader& map, const Profile& profile, Device& device, LoadContext& context) {
  map.Read<&Device::unit>(device);
  if (device.unit) context.uniques.Unit(*device.unit, device.name, map.MarkOf("unit"));
  const bool has_on_bad = map.Read<&Device::on_bad>(device);
  Assign(device.word_order, profile.word_order);
  const bool has_word_order = map.Read<&Device::word_order>(device);
  const auto check = [&](const std::string& key, bool given) {
    if (device.unit || !given || map.Has("unit")) return;
    map.problems().Error(map.MarkOf(key),
                         key +
                             ": applies only to Modbus clients of this gateway, but the device has "
                             "no 'unit'; add 'unit', or remove the key");
  };
  check("on_bad", has_on_bad);
  check("word_order", has_word_order);
}

void ReadDeviceOptions(MapReader& map, const protocols::Protocol* protocol,
                       const Options& line_options, const Profile& profile, bool line_speaks_it,
                       Device& device) {
  if (!protocol) return;
  device.options = DefaultOptions(*protocol);
  if (line_speaks_it) Override(device.options, line_options);
  Override(device.options, profile.options);
  Override(device.options, ReadOptions(map, *protocol, protocols::OptionSpec::Scope::device));
}

/// Returns the names that the device may report, and names of other device types.
Identity IdentityOf(MapReader& map, const Profile& profile, const protocols::Protocol* protocol,
                    LoadContext& context) {
  Identity identity = ReadIdentity(map, profile.identity);
  // If the device type lists no names, a reported name cannot contradict it.
  if (!protocol || identity.ignore || identity.names.empty()) return identity;
  const auto [listed, is_new] = context.listed_names.try_emplace(std::string(protocol->name));
  if (is_new) listed->second = ListedNames(context.catalog, *protocol);
  identity.others = listed->second;
  for (const std::string& name : identity.names) identity.others.erase(SpokenName(name));
  std::erase_if(identity.others, [&](const auto& other) { return other.second == profile.name; });
  return identity;
}

void ReadPoints(MapReader& map, const RawProfile* profile, const protocols::Protocol* protocol,
                Device& device, LoadContext& context) {
  const auto own = map.Get("points");
  context.points += (profile ? profile->points.size() : 0) + (own ? own->yaml().size() : 0);
  if (context.points > kMostPointsOfAll) {
    context.problems.Error(device.mark, "the gateway has too many points; at most " +
                                            std::to_string(kMostPointsOfAll));
    return;
  }
  std::vector<RawPoint> raw;
  if (profile) raw = profile->points;
  if (own) {
    raw = MergePoints(std::move(raw), ReadRawPoints(*own, context.problems), context.problems);
  }
  device.points = BuildPoints(raw, protocol, context.problems, device.recheck);
  AssignIntervals(device, context.problems);
}

// Reports an error at the device that uses a profile with errors; the errors themselves are
// reported in the profile.
void BlameProfile(const MapReader& map, const RawProfile& raw, LoadContext& context) {
  if (!context.problems.HasErrorIn(raw.file) || !context.bad_profiles.insert(raw.file).second) {
    return;
  }
  context.problems.Error(map.MarkOf("profile"), "profile: " + Quoted(raw.profile.name) + " of " +
                                                    map.what() + " has errors; see " + raw.file);
}

// Reports a protocol over TCP on a line for serial protocols, or the reverse. The line decides
// whether there are serial settings, so all its devices must agree.
void CheckOwnTcp(const protocols::Protocol& protocol, const LineContext& of, const Keys& keys,
                 Problems& problems) {
  CheckTcp(protocol, {}, keys, problems);
  if (of.protocol == nullptr || protocol.tcp == of.protocol->tcp) return;
  problems.Error(keys.MarkOf("protocol"),
                 "protocol: " + std::string(protocol.name) + " cannot share a line with " +
                     std::string(of.protocol->name) + "; move this device to a line of its own");
}

}  // namespace

Recheck DefaultRecheck(const protocols::Protocol& protocol, const SerialSettings& serial) {
  return protocol.weak_check && serial.parity == Parity::none ? Recheck::jump : Recheck::off;
}

const protocols::Protocol* ReadProtocol(const YamlNode& node, const std::string& port,
                                        LoadContext& context) {
  const auto name = ReadText(node, "protocol", context.problems);
  if (!name) return nullptr;
  const auto protocol = context.catalog.NeedProtocol(*name, port);
  if (protocol) return *protocol;
  context.problems.Error(node.mark(), "protocol: " + protocol.error());
  return context.catalog.MeantProtocol(*name, port);
}

bool IsNeverOld(const protocols::Protocol& protocol, const Options& options) {
  return protocol.never_old && SpeaksUnasked(protocol, options);
}

Device ReadDevice(const YamlNode& node, const LineContext& of, LoadContext& context) {
  Device device;
  device.mark = node.mark();
  MapReader map(node, "device", context.problems);
  if (node.kind() != YamlNode::Kind::map) return device;
  if (const auto name = ReadName(map, "feeder-1")) {
    device.name = *name;
    context.uniques.Device(device.name, map.MarkOf("name"));
  }
  const protocols::Protocol* protocol = of.protocol;
  if (const auto own = map.Get("protocol")) protocol = ReadProtocol(*own, of.line.port, context);
  if (!protocol) map.AllowAll();
  if (protocol) {
    device.protocol = std::string(protocol->name);
    device.traits = &protocol->traits;
  }
  ReadAddress(map, of.addresses, protocol, device);
  map.Read<&Device::enabled, &Device::trust_order>(device);
  if (const auto serial = map.Get("serial")) {
    device.serial = ReadSerial(*serial, of.line.serial, context.problems);
    CheckPortSettings(of.line.port, *device.serial, serial->mark(), context.problems);
  }
  if (protocol && (device.serial || protocol != of.protocol)) {
    CheckDataBits(device.serial.value_or(of.line.serial), *protocol,
                  map.MarkOf(device.serial ? "serial" : "protocol"), context.problems);
  }
  if (protocol) CheckOwnTcp(*protocol, of, map.keys(), context.problems);
  const RawProfile* raw = FindProfile(map, protocol, device, context);
  const Profile profile = raw ? raw->profile : Profile();
  device.title = profile.title;
  device.event_texts = profile.event_texts;
  device.identity = IdentityOf(map, profile, protocol, context);
  const Pace pace = ReadTimes(map, profile, of.pace, device);
  device.recheck = pace.recheck.value_or(Recheck::off);
  if (protocol && !pace.recheck) {
    device.recheck = DefaultRecheck(*protocol, device.serial.value_or(of.line.serial));
  }
  ReadModbusSide(map, profile, device, context);
  ReadDeviceOptions(map, protocol, of.options, profile, protocol == of.protocol, device);
  if (protocol) device.never_old = IsNeverOld(*protocol, device.options);
  ReadPoints(map, raw, protocol, device, context);
  ResolveSentinels(device, protocol, context.problems);
  ReadDeviceEvents(map, context.events, device);
  device.alarms = ReadAlarmSetting(map, of.line.alarms);
  if (protocol && (raw || !map.Has("profile"))) {
    ResolveRecords(profile.records, device, context.problems);
    ReadEventAlarms(map, device);
    ApplyRatios(map, device);
    ApplyWritePermit(map, device);
  } else {
    // The points are unknown, so keys that name points are accepted without a check.
    for (const char* key : {"event_alarms", "ratios", "allow_when", "write"}) map.Get(key);
  }
  if (raw) BlameProfile(map, *raw, context);
  map.Finish();
  CheckDevice(device, protocol, map.keys(), context.problems);
  return device;
}

}  // namespace baudgate::config
