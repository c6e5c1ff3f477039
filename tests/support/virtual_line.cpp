// SPDX-License-Identifier: Apache-2.0
#include "tests/support/virtual_line.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/bus/poller/poller.h"
#include "gateway/diagnosis/observer.h"

namespace baudgate {
namespace {

/// More events than this at one instant are an endless loop.
constexpr int kMostStepsInPlace = 10'000;

config::Config ConfigOf(config::Line line) {
  config::Config config;
  for (config::Device& device : line.devices) {
    if (device.protocol.empty()) device.protocol = line.protocol;
  }
  config.lines.push_back(std::move(line));
  return config;
}

}  // namespace

VirtualLine::VirtualLine(config::Line line, std::vector<const protocols::Protocol*> protocols,
                         std::vector<config::Device> others)
    : config_(ConfigOf(std::move(line))),
      find_([protocols](const std::string& name) -> const protocols::Protocol& {
        return **std::find_if(
            protocols.begin(), protocols.end(),
            [&](const protocols::Protocol* protocol) { return protocol->name == name; });
      }),
      others_(std::move(others)) {
  const auto add_twin = [&](const config::Device& device) {
    auto twin = std::make_unique<WireTwin>();
    twin->twin = find_(device.protocol).make_twin(device, twin->values);
    twins_.push_back(std::move(twin));
  };
  for (const config::Device& device : config_.lines[0].devices) add_twin(device);
  for (const config::Device& device : others_) add_twin(device);
  store_ = std::make_unique<bus::PointStore>(config_);
  MakePoller();
}

void VirtualLine::MakePoller() {
  bus::RequestPort& port = *this;
  bus::PollerListener& listener = *this;
  poller_ = std::make_unique<bus::Poller>(config_.lines[0], 0U, find_, *store_, port, listener,
                                          &diagnosis::Observe);
  sends_ = 0;
  const auto& devices = config_.lines[0].devices;
  for (std::uint32_t i = 0; i < devices.size(); ++i) {
    if (devices[i].events) poller_->OnEventsKept(i, said ? said(i) : std::string(), now());
  }
}

VirtualLine::~VirtualLine() = default;

bool VirtualLine::Submit(bus::WriteCommand command) {
  if (auto* const writes = std::get_if<bus::Writes>(&command.kind)) {
    const auto its = store_->device(command.device);
    const auto& points = its->points;
    for (bus::PointWrite& write : *writes) {
      write.shown = bus::ToSample(points[write.point], {write.point, write.raw}).value;
    }
  }
  return poller_->Submit(std::move(command), now());
}
void VirtualLine::Submit(bus::RoutedRequest request) { poller_->Submit(std::move(request), now()); }
bool VirtualLine::asking() const { return sends_ > poller_->accounts().line.counters().exchanges; }

void VirtualLine::Open() {
  open_ = true;
  poller_->OnOpened(now(), keeps_bit_rate);
}

void VirtualLine::Close() {
  open_ = false;
  arriving_.clear();
  poller_->OnClosed(now());
}

void VirtualLine::OnEvents(bus::ReportedEvents reported) {
  keeping_.emplace(instant_ + keep_time, std::move(reported));
}

void VirtualLine::Restart() {
  Close();
  keeping_.clear();
  MakePoller();
  Open();
}

void VirtualLine::RunFor(Duration time) {
  RunUntil([] { return false; }, time);
}

bool VirtualLine::RunUntil(const std::function<bool()>& done, Duration limit) {
  const Instant until = instant_ + limit;
  int in_place = 0;
  while (!done()) {
    const Instant before = instant_;
    Step(until);
    if (always) always();
    if (instant_ == until && !(poller_->Deadline() && *poller_->Deadline() <= until)) return done();
    in_place = instant_ == before ? in_place + 1 : 0;
    if (in_place > kMostStepsInPlace) {
      ADD_FAILURE() << "time stands still: a deadline that has come does nothing";
      return false;
    }
  }
  return true;
}

void VirtualLine::Step(Instant until) {
  const auto deadline = poller_->Deadline();
  const Instant timer = deadline ? std::max(*deadline, instant_) : Instant::max();
  const Instant arrives = arriving_.empty() ? Instant::max() : arriving_.begin()->first;
  if (!keeping_.empty() && keeping_.begin()->first <= std::min({timer, until, arrives})) {
    auto first = keeping_.extract(keeping_.begin());
    instant_ = std::max(instant_, first.key());
    const std::uint32_t device = first.mapped().device;
    const std::string its_words = first.mapped().batch.said;
    const bool kept = !keep || keep(first.mapped());
    if (!kept) {
      keeping_.emplace(instant_ + 1s, std::move(first.mapped()));
      return;
    }
    if (!keep) events.push_back(std::move(first.mapped()));
    poller_->OnEventsKept(device, its_words, now());
  } else if (!arriving_.empty() && arriving_.begin()->first <= std::min(timer, until)) {
    auto first = arriving_.extract(arriving_.begin());
    instant_ = std::max(instant_, first.key());
    if (open_) poller_->Receive(first.mapped(), now());
  } else if (timer <= until) {
    instant_ = timer;
    poller_->OnTimer(now());
  } else {
    instant_ = until;
  }
}

void VirtualLine::Stop(Duration time, bool timers_first) {
  instant_ += time;
  Bytes held;
  while (!arriving_.empty() && arriving_.begin()->first <= instant_) {
    Append(held, arriving_.begin()->second);
    arriving_.erase(arriving_.begin());
  }
  if (timers_first) poller_->OnTimer(now());
  if (open_ && !held.empty()) poller_->Receive(held, now());
  if (always) always();
}

void VirtualLine::Inject(Bytes bytes, Duration after) {
  arriving_.emplace(instant_ + after, std::move(bytes));
}

bool VirtualLine::Write(std::uint32_t device, std::uint32_t point, Value raw, Duration within) {
  bus::WriteCommand command;
  command.device = device;
  command.kind = bus::Writes{{point, std::move(raw)}};
  command.deadline = instant_ + within;
  command.done = [this](const WriteResult& result) { ends.push_back(result.end); };
  return Submit(std::move(command));
}

void VirtualLine::Send(View bytes, const config::SerialSettings& serial, Now) {
  unsent_ = holds;
  if (holds) return;
  ++sends_;
  if (keep_sent) sent.push_back({instant_, std::string(AsText(bytes))});
  const Duration character = serial.CharacterTime();
  const Instant end = instant_ + static_cast<std::int64_t>(bytes.size()) * character;
  if (echo) {
    Instant at = instant_;
    for (const std::uint8_t byte : echo(bytes)) arriving_.emplace(at += character, Bytes{byte});
  }
  Bytes said;
  for (const auto& twin : twins_) {
    const Manner& manner = twin->manner;
    if (manner.dead) continue;
    Bytes reply = twin->twin->Answer(bytes, end);
    if (!reply.empty()) ++twin->answered;
    if (server) {
      if (!reply.empty() && manner.instead) reply = manner.instead(bytes).value_or(reply);
      Append(said, reply);
      continue;
    }
    if (manner.deliver) {
      for (const tools::TimedPiece& piece : manner.deliver(bytes, std::move(reply), end))
        Deliver(piece, manner.fragment, end, character);
      continue;
    }
    if (reply.empty()) continue;
    if (manner.instead) reply = manner.instead(bytes).value_or(reply);
    if (manner.babble > Duration::zero()) {
      reply.assign(static_cast<std::size_t>(manner.babble / character), 0x55);
    }
    if (manner.distort) reply = manner.distort(std::move(reply));
    Bytes whole;
    for (int i = 0; i < manner.copies; ++i) Append(whole, reply);
    Deliver(manner, std::move(whole), end + manner.think, character);
  }
  if (!server) return;
  for (const tools::TimedPiece& piece : server(bytes, std::move(said), end)) {
    Deliver(piece, 0, end, character);
  }
}

void VirtualLine::Deliver(const Manner& manner, Bytes reply, Instant from, Duration character) {
  std::size_t fragment = manner.fragment == 0 ? reply.size() : manner.fragment;
  if (manner.babble > Duration::zero()) fragment = 1;
  Instant at = from;
  for (std::size_t i = 0; i < reply.size(); i += fragment) {
    const View piece = View(reply).subspan(i, std::min(fragment, reply.size() - i));
    at += static_cast<std::int64_t>(piece.size()) * character;
    arriving_.emplace(at, Bytes(piece.begin(), piece.end()));
    at += manner.pause;
  }
}

void VirtualLine::Deliver(const tools::TimedPiece& piece, std::size_t fragment,
                          Instant end_of_request, Duration character) {
  if (fragment == 0) fragment = piece.bytes.size();
  View rest = piece.bytes;
  while (!rest.empty()) {
    const View part = rest.first(std::min(fragment, rest.size()));
    rest = rest.subspan(part.size());
    const Duration to_come = static_cast<std::int64_t>(rest.size()) * character;
    arriving_.emplace(end_of_request + piece.after - to_come, Bytes(part.begin(), part.end()));
  }
}

void VirtualLine::OnDeviceState(std::uint32_t device, bus::DeviceState, bus::DeviceState to,
                                const std::string&, Now) {
  states.push_back({instant_, device, to});
}

Quality VirtualLine::QualityOf(std::uint32_t device, std::uint32_t point) const {
  Quality quality{};
  store_->Read(device, [&](const bus::DeviceRecord& record) {
    quality = QualityAt(record, point, instant_);
  });
  return quality;
}

std::optional<Duration> VirtualLine::AgeOf(std::uint32_t device, std::uint32_t point) const {
  std::optional<Duration> age;
  store_->Read(device,
               [&](const bus::DeviceRecord& record) { age = AgeAt(record, point, instant_); });
  return age;
}

Value VirtualLine::ValueOf(std::uint32_t device, std::uint32_t point) const {
  Value value;
  store_->Read(device,
               [&](const bus::DeviceRecord& record) { value = record.points[point].value; });
  return value;
}

bus::DeviceStatus VirtualLine::StatusOf(std::uint32_t device) const {
  bus::DeviceStatus status;
  store_->Read(device, [&](const bus::DeviceRecord& record) { status = record.status; });
  return status;
}

std::size_t VirtualLine::CountSent(std::string_view start) const {
  return static_cast<std::size_t>(std::count_if(
      sent.begin(), sent.end(), [&](const Sent& one) { return one.text.starts_with(start); }));
}

config::Device ToyDevice(std::string name, std::string address, std::vector<std::string> reads) {
  config::Device device;
  device.name = std::move(name);
  device.address = std::move(address);
  device.protocol = "toy";
  device.options = ToyOptions();
  for (std::string& read : reads) {
    config::Point point;
    point.name = "p" + read;
    point.read = std::move(read);
    point.type = config::Type::float64;
    point.access = config::Access::read_write;
    device.points.push_back(std::move(point));
  }
  return device;
}

config::Line ToyLine(std::vector<config::Device> devices) {
  config::Line line;
  line.name = "line";
  line.protocol = "toy";
  line.devices = std::move(devices);
  return line;
}

}  // namespace baudgate
