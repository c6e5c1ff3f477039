// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/sparkplug_node.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::mqtt {
namespace {

using sparkplug::Metric;
using sparkplug::QualityCode;

constexpr char kNamespace[] = "spBv1.0/";
constexpr char kBdSeq[] = "bdSeq";
constexpr char kRebirth[] = "Node Control/Rebirth";

std::uint64_t Milliseconds(WallTime time) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(time.time_since_epoch() / 1ms, 0));
}

/// Returns the alias of a point, which is unique in the node and never changes while the gateway
/// runs.
std::uint64_t AliasOf(std::uint32_t device, std::uint32_t point) {
  return (static_cast<std::uint64_t>(device) << 20U) + point + 1;
}

Metric MetricOf(const config::Point& point, std::uint64_t alias, const Reading& reading,
                WallTime now) {
  Metric metric;
  metric.alias = alias;
  metric.type = sparkplug::TypeOf(point);
  metric.timestamp = Milliseconds(reading.time.value_or(now));
  metric.quality = IsGood(reading.quality)        ? QualityCode::good
                   : IsUncertain(reading.quality) ? QualityCode::stale
                                                  : QualityCode::bad;
  if (!IsBad(reading.quality)) metric.value = reading.value;
  return metric;
}

}  // namespace

SparkplugNode::SparkplugNode(const config::Mqtt& settings, std::string gateway, std::string barrier,
                             bus::PointStore& store, LivePoints& live, Client& client, Write write)
    : settings_(settings),
      gateway_(std::move(gateway)),
      barrier_(std::move(barrier)),
      store_(store),
      live_(live),
      client_(client),
      write_(std::move(write)) {}

std::string SparkplugNode::Topic(const char* type, const std::string& device) const {
  return kNamespace + settings_.prefix + "/" + type + "/" + gateway_ +
         (device.empty() ? "" : "/" + device);
}

std::string SparkplugNode::Death() const {
  Metric metric{.name = kBdSeq, .type = sparkplug::DataType::int64};
  metric.value = std::int64_t{bd_seq_};
  return sparkplug::Encode({Milliseconds(ReadClocks().wall), {metric}, std::nullopt});
}

Client::Will SparkplugNode::NextWill() {
  ++bd_seq_;
  return {Topic("NDEATH"), Death(), false};
}

void SparkplugNode::OnConnected() {
  client_.Subscribe(Topic("NCMD"));
  if (settings_.commands) client_.Subscribe(Topic("DCMD", "+"));
  host_online_ = settings_.primary_host.empty();
  host_time_ = 0;
  host_left_ = false;
  if (!host_online_) {
    client_.Subscribe(std::string(kNamespace) + "STATE/" + settings_.primary_host);
  }
  Rebirth();
}

void SparkplugNode::Rebirth() {
  born_ = false;
  next_birth_ = 0;
  live_.StartAnew();
}

void SparkplugNode::Publish(const std::string& topic, sparkplug::Payload payload) {
  payload.timestamp = Milliseconds(ReadClocks().wall);
  payload.seq = seq_++;
  client_.Publish(topic, sparkplug::Encode(payload), 0, false);
}

void SparkplugNode::BirthNode(Now now) {
  seq_ = 0;
  const std::uint64_t time = Milliseconds(now.wall);
  Metric number{.name = kBdSeq, .timestamp = time, .type = sparkplug::DataType::int64};
  number.value = std::int64_t{bd_seq_};
  Metric rebirth{.name = kRebirth, .timestamp = time, .type = sparkplug::DataType::boolean};
  rebirth.value = false;
  Publish(Topic("NBIRTH"), {time, {number, rebirth}, 0});
  devices_.assign(live_.size(), DeviceState::unborn);
  names_.clear();
  born_ = true;
}

bool SparkplugNode::IsOffline(std::uint32_t device) const {
  bool offline = true;
  store_.Read(device, [&](const bus::DeviceRecord& record) {
    offline = record.override_quality.has_value();
  });
  return offline || store_.gone(device);
}

void SparkplugNode::BirthDevice(std::uint32_t device, Now now, bool anyway) {
  if (IsOffline(device) && !anyway) return;
  sparkplug::Payload birth;
  std::string name;
  live_.SendAll(device, now, [&](const LivePoints::Point& at, const Reading& reading) {
    Metric metric = MetricOf(at.point, AliasOf(device, at.number), reading, now.wall);
    metric.name = at.point.name;
    birth.metrics.push_back(std::move(metric));
    name = at.device.name;
    return true;
  });
  if (birth.metrics.empty()) return;
  values_ += birth.metrics.size();
  Publish(Topic("DBIRTH", name), std::move(birth));
  devices_[device] = DeviceState::born;
  names_[device] = name;
}

void SparkplugNode::KillDevice(std::uint32_t device) {
  if (devices_[device] != DeviceState::born) return;
  devices_[device] = DeviceState::dead;
  Publish(Topic("DDEATH", names_[device]), {});
}

void SparkplugNode::Flush(std::uint32_t device, std::vector<Metric> metrics, Now now) {
  if (IsOffline(device)) return KillDevice(device);
  if (devices_[device] != DeviceState::born) return BirthDevice(device, now);
  values_ += metrics.size();
  Publish(Topic("DDATA", names_[device]), {0, std::move(metrics), std::nullopt});
}

void SparkplugNode::Send(Now now) {
  if (std::exchange(host_left_, false)) {
    // The broker then publishes the will, NDEATH.
    return client_.Reconnect("is left, because the primary host " + settings_.primary_host +
                             " is offline");
  }
  if (!host_online_) return;
  client_.Gather(true);
  if (!born_) BirthNode(now);
  for (; next_birth_ < live_.size() && !client_.busy(); ++next_birth_) {
    BirthDevice(next_birth_, now);
  }
  if (born()) {
    std::map<std::uint32_t, std::vector<Metric>> changed;
    live_.Send(now, [&](const LivePoints::Point& at, const Reading& reading) {
      if (client_.busy()) return false;
      changed[at.device_number].push_back(
          MetricOf(at.point, AliasOf(at.device_number, at.number), reading, now.wall));
      return true;
    });
    for (auto& [device, metrics] : changed) Flush(device, std::move(metrics), now);
  }
  client_.Gather(false);
}

void SparkplugNode::SendStored(const outlet::Portion& portion,
                               const std::function<void(outlet::Answer)>& done) {
  const Now now = ReadClocks();
  std::map<std::string, bus::PointRef> places;
  live_.Each([&](const LivePoints::Point& at) {
    places[at.line.name + "." + at.device.name + "." + at.point.name] = {at.device_number,
                                                                         at.number};
  });
  outlet::Answer answer;
  std::map<std::uint32_t, std::vector<Metric>> metrics;
  for (std::size_t i = 0; i < portion.values.size(); ++i) {
    const outlet::KeptValue& value = portion.values[i];
    const auto place = places.find(value.point);
    if (place == places.end()) {
      // A birth cannot describe a point that no longer exists.
      answer.refused.push_back(i);
      answer.kind = outlet::Answer::Kind::refused;
      answer.why = value.point + " is no longer configured, so no birth describes it";
      continue;
    }
    const auto device = store_.device(place->second.device);
    if (!device) continue;
    const Reading reading{value.entry.value, value.entry.quality,
                          history::ToWall(value.entry.time)};
    Metric metric = MetricOf(device->points[place->second.point],
                             AliasOf(place->second.device, place->second.point), reading, now.wall);
    metric.historical = true;
    metrics[place->second.device].push_back(std::move(metric));
  }
  client_.Gather(true);
  for (auto& [device, its] : metrics) {
    // A device that does not answer is born for its stored values only.
    const bool dead = devices_[device] != DeviceState::born;
    if (dead) BirthDevice(device, now, true);
    Publish(Topic("DDATA", names_[device]), {0, std::move(its), std::nullopt});
    if (dead) KillDevice(device);
  }
  // DDATA has QoS 0. The broker handles the messages of a connection in order, so a confirmation of
  // the next message confirms the values as well.
  const std::string failed = client_.Publish(
      barrier_, std::to_string(portion.values.back().seq), 1, false,
      [answer, done](const Delivery& delivery) {
        const bool taken =
            delivery.kind == Delivery::Kind::confirmed || delivery.kind == Delivery::Kind::refused;
        done(taken ? answer : outlet::Answer{outlet::Answer::Kind::retry, delivery.why});
      });
  client_.Gather(false);
  if (!failed.empty()) done({outlet::Answer::Kind::retry, failed});
}

void SparkplugNode::TakeState(const Message& message) {
  const auto json = nlohmann::json::parse(message.payload, nullptr, false);
  if (!json.is_object() || !json.contains("online") || !json["online"].is_boolean()) return;
  const bool has_time = json.contains("timestamp") && json["timestamp"].is_number_integer();
  const std::int64_t time = has_time ? json["timestamp"].get<std::int64_t>() : host_time_;
  if (time < host_time_) return;
  host_time_ = time;
  const bool online = json["online"].get<bool>();
  if (online == host_online_) return;
  host_online_ = online;
  host_left_ = !online;
}

void SparkplugNode::Take(const Message& message) {
  const auto levels = Split(message.topic, '/');
  if (levels.size() == 3 && levels[1] == "STATE") return TakeState(message);
  const auto payload = sparkplug::Decode(message.payload);
  if (!payload || levels.size() < 4) return;
  if (levels[2] == "DCMD" && levels.size() == 5) {
    return TakeWrite(message, *payload, std::string(levels[4]));
  }
  for (const Metric& metric : payload->metrics) {
    const auto* wanted = std::get_if<bool>(&metric.value);
    if (metric.name == kRebirth && wanted != nullptr && *wanted && !message.retained) Rebirth();
  }
}

void SparkplugNode::TakeWrite(const Message& message, const sparkplug::Payload& payload,
                              const std::string& device) {
  for (const Metric& metric : payload.metrics) {
    std::optional<bus::PointRef> at;
    live_.Each([&](const LivePoints::Point& one) {
      const bool is_named = one.device.name == device && one.point.name == metric.name;
      const bool has_alias =
          metric.alias && AliasOf(one.device_number, one.number) == *metric.alias;
      if (metric.alias && metric.name.empty() ? has_alias && one.device.name == device : is_named) {
        at = bus::PointRef{one.device_number, one.number};
      }
    });
    if (at) write_(*at, ToText(metric.value), message.retained);
  }
}

}  // namespace baudgate::mqtt
