// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/residents.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "gateway/base/text.h"

namespace baudgate::tools {
namespace {

constexpr double kWaveSeconds = 60;

}  // namespace

SimulatedValues::SimulatedValues(const std::vector<config::Point>& points, std::uint32_t seed)
    : points_(points), seed_(seed), written_(points.size()) {}

Value SimulatedValues::Get(std::size_t index, Instant now) const {
  if (HasValue(written_[index])) return written_[index];
  const config::Point& point = points_[index];
  const config::Simulate& simulate = *point.simulate;
  if (point.type == config::Type::string) return simulate.text.value_or(std::string());
  const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
  const double phase = 0.7 * static_cast<double>(index) + 2.1 * static_cast<double>(seed_);
  const double wave = std::sin(2 * std::numbers::pi * seconds / kWaveSeconds + phase);
  const double value = simulate.low + (simulate.high - simulate.low) * (0.5 + 0.5 * wave);
  switch (point.type) {
    case config::Type::boolean:
      return value >= 0.5;
    case config::Type::float32:
    case config::Type::float64:
      return value;
    default:
      return static_cast<std::int64_t>(std::llround(value));
  }
}

void SimulatedValues::Set(std::size_t point, const Value& value) { written_[point] = value; }

namespace {

constexpr std::size_t kMostAtATime = 1000;
constexpr Duration kLongest = 24h;

}  // namespace

Result<EventSchedule> ParseEventSchedule(std::string_view text) {
  const Error error{
      "'" + std::string(text) +
      "' is no event schedule; write for example every:5s, or every:1s,count=3,numbered"};
  constexpr std::string_view kEvery = "every:";
  if (!text.starts_with(kEvery)) return error;
  const auto parts = Split(text.substr(kEvery.size()), ',');
  EventSchedule schedule;
  const auto every = ParseDuration(parts.front());
  if (!every || *every < 1ms || *every > kLongest) return error;
  schedule.every = *every;
  constexpr std::string_view kCount = "count=";
  for (std::size_t i = 1; i < parts.size(); ++i) {
    if (parts[i] == "numbered") {
      schedule.numbered = true;
      continue;
    }
    if (!parts[i].starts_with(kCount)) return error;
    const auto count = ParseInteger<std::size_t>(parts[i].substr(kCount.size()));
    if (!count || *count < 1 || *count > kMostAtATime) return error;
    schedule.count = *count;
  }
  return schedule;
}

protocols::DeviceEvent TwinEvents::Next(const config::Device& device) const {
  protocols::DeviceEvent event{0, 1, {}, {}};
  std::vector<const config::EventText*> known;
  for (const config::EventText& one : device.event_texts) {
    if (one.state != config::EventState::message) known.push_back(&one);
  }
  if (!known.empty()) {
    const config::EventText& one = *known[raised_ % known.size()];
    event.channel = one.channel.value_or(0);
    event.code = one.code;
  }
  if (schedule_.numbered) event.text = std::to_string(raised_ + 1);
  return event;
}

void TwinEvents::CatchUp(protocols::Twin& twin, const config::Device& device, Now now) {
  for (;;) {
    const Duration due = static_cast<std::int64_t>(rounds_ + 1) * schedule_.every;
    if (start_.instant + due > now.instant) return;
    ++rounds_;
    for (std::size_t i = 0; i < schedule_.count; ++i) {
      const bool taken = twin.Raise(Next(device), {start_.instant + due, start_.wall + due});
      ++(taken ? raised_ : refused_);
    }
  }
}

namespace {

constexpr Duration kOwnEvents = 2s;

}  // namespace

std::optional<std::string> FreeAddress(const protocols::Protocol& protocol,
                                       std::span<const config::Device> devices) {
  std::set<std::string> taken;
  for (const config::Device& device : devices) {
    taken.insert(protocol.canonical_address(device.address).value());
  }
  for (std::size_t number = 1; number <= devices.size() + 1; ++number) {
    const auto address = protocol.canonical_address(std::to_string(number));
    if (address && !taken.contains(*address)) return *address;
  }
  return std::nullopt;
}

Residents::Residents(const protocols::Protocol& protocol, std::vector<config::Device> devices,
                     const TwinWire& wire, const std::optional<EventSchedule>& events)
    : protocol_(protocol),
      wire_(wire),
      options_(ParseOptions(protocol, devices.front().options)),
      twins_(MakeTwins(protocol, std::move(devices), 0)) {
  auto schedule = events;
  if (!schedule && speaks_unasked()) schedule = EventSchedule{.every = kOwnEvents};
  for (const auto& one : twins_) {
    if (schedule) one->events.emplace(*schedule, ReadClocks());
  }
}

bool Residents::speaks_unasked() const {
  return std::ranges::any_of(twins_, [this](const auto& one) {
    return protocols::SpeaksUnasked(protocol_, one->device.options);
  });
}

/// `seed`: the seed of the first simulated device; each further simulated device gets the next
/// number.
Residents::Twins Residents::MakeTwins(const protocols::Protocol& protocol,
                                      std::vector<config::Device> devices, std::uint32_t seed) {
  Twins twins;
  for (config::Device& device : devices) {
    auto resident = std::make_unique<Resident>();
    resident->device = std::move(device);
    resident->values = std::make_unique<SimulatedValues>(resident->device.points, seed++);
    resident->twin = protocol.make_twin(resident->device, *resident->values);
    resident->twin->SetClock(ReadClocks());
    twins.push_back(std::move(resident));
  }
  return twins;
}

Residents::Reply Residents::ReplyOf(const Twins& twins, View request, Instant now) {
  for (const auto& one : twins) {
    Bytes bytes = one->twin->Answer(request, now);
    if (!bytes.empty()) return {std::move(bytes), one.get()};
  }
  return {};
}

const config::SerialSettings& Residents::SerialOf(const Resident& resident) const {
  return resident.device.serial ? *resident.device.serial : wire_.serial;
}

Residents::Answer Residents::Hear(View request, Instant end) {
  Answer answer;
  answer.serial = wire_.serial;
  const bool dead = IsDead(end);
  answer.interrupts = dead;
  if (!dead) {
    RaiseEvents(ReadClocks());
    Reply reply = ReplyOf(twins_, request, end);
    answer.reply = std::move(reply.bytes);
    if (reply.speaker != nullptr) answer.serial = SerialOf(*reply.speaker);
  }
  if (faults_) {
    answer.heard = faults_->Deliver(request, answer.reply, end);
  } else if (!answer.reply.empty()) {  // only a new reply drops pieces of earlier replies
    answer.interrupts = true;
    TwinWire wire = wire_;
    wire.serial = answer.serial;
    answer.heard.push_back({wire.think + wire.TimeOf(answer.reply.size()), answer.reply});
  }
  return answer;
}

bool Residents::IsDead(Instant now) {
  const bool dead = faults_ && faults_->IsDead(now);
  if (std::exchange(was_dead_, dead) && !dead) {
    for (const auto& one : twins_) {
      one->twin = protocol_.make_twin(one->device, *one->values);
      one->twin->SetClock(ReadClocks());
    }
  }
  return dead;
}

void Residents::RaiseEvents(Now now) {
  for (const auto& one : twins_) {
    if (one->events) one->events->CatchUp(*one->twin, one->device, now);
  }
}

Bytes Residents::Say(Now now) {
  RaiseEvents(now);
  for (const auto& one : twins_) {
    Bytes message = one->twin->Say(now.instant);
    if (!message.empty()) return message;
  }
  return {};
}

void Residents::SetFaults(const std::vector<Fault>& wanted, Instant now) {
  faults_.reset();
  strangers_.clear();
  if (wanted.empty()) return;
  const bool foreign = std::any_of(wanted.begin(), wanted.end(), [](const Fault& fault) {
    return fault.kind == Fault::Kind::wrong_address;
  });
  if (foreign) strangers_ = MakeStrangers();
  faults_.emplace(wanted, wire_, now, [this](View request, Instant at) {
    return ReplyOf(strangers_, request, at).bytes;
  });
}

/// Makes copies of the simulated devices with different values, for the fault wrong_address. All
/// copies reply under one address that no simulated device has.
Residents::Twins Residents::MakeStrangers() const {
  std::vector<config::Device> devices;
  for (const auto& one : twins_) devices.push_back(one->device);
  const auto address = FreeAddress(protocol_, devices);
  if (!address) return {};
  const auto seed = static_cast<std::uint32_t>(devices.size());
  Twins made = MakeTwins(protocol_, std::move(devices), seed);
  for (const auto& stranger : made) stranger->twin->ReplyAs(*address);
  return made;
}

std::vector<FaultCount> Residents::fault_counts() const {
  return faults_ ? faults_->Counts() : std::vector<FaultCount>();
}

std::pair<std::uint64_t, std::uint64_t> Residents::event_counts() const {
  std::pair<std::uint64_t, std::uint64_t> counts;
  for (const auto& one : twins_) {
    counts.first += one->events ? one->events->raised() : 0;
    counts.second += one->events ? one->events->refused() : 0;
  }
  return counts;
}

}  // namespace baudgate::tools
