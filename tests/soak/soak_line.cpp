// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/soak_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <asio/post.hpp>
#include <asio/use_future.hpp>
#include <numeric>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "protocols/assembler.h"

namespace baudgate {
namespace {

constexpr Duration kFastPeriod = 20ms;
constexpr Duration kSlowPeriod = 5s;
constexpr std::size_t kMostTold = 20;

template <typename Work>
void RunIn(asio::io_context& io, Work work) {
  asio::post(io, asio::use_future(std::move(work))).wait();
}

void Pin(config::Point& point, const Value& value) {
  if (!point.simulate || point.simulate->text) return;
  point.simulate = config::Simulate{ToDouble(value), ToDouble(value), std::nullopt};
}

tools::Fault MakeFault(const std::string& text) {
  const auto fault = tools::ParseFault(text);
  if (!fault) {
    ADD_FAILURE() << fault.error();
    return {};
  }
  return *fault;
}

}  // namespace

void WeakChecksums::OnDelivery(View request, View reply, View delivered) {
  const bool echo = delivered.size() >= request.size() &&
                    std::equal(request.begin(), request.end(), delivered.begin());
  if (echo) delivered = delivered.subspan(request.size());
  protocols::Assembler assembler;
  assembler.Begin(setup_.protocol->reply_rule, setup_.protocol->expect(request, options_));
  assembler.Feed(delivered);
  auto frame = assembler.Next(false);
  if (!frame) frame = assembler.Next(true);
  if (!frame || !setup_.good_checksum(*frame)) return;
  if (std::search(reply.begin(), reply.end(), frame->begin(), frame->end()) != reply.end()) return;
  const std::lock_guard lock(mutex_);
  deliveries_.push_back(std::chrono::steady_clock::now());
}

bool WeakChecksums::MayHaveReached(Instant read_at, Duration longest_exchange) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(deliveries_.begin(), deliveries_.end(),
                     [&](Instant at) { return at <= read_at && read_at - at <= longest_exchange; });
}

std::size_t WeakChecksums::count() const {
  const std::lock_guard lock(mutex_);
  return deliveries_.size();
}

SoakLine::SoakLine(const protocols::Setup& setup, bool echoes, const std::string& port,
                   asio::io_context& world)
    : setup_(setup), echoes_(echoes), world_(world) {
  config_.lines.push_back(LineOf(setup));
  config::Line& line = config_.lines.front();
  line.name = setup.name;
  line.port = port;
  if (echoes) line.echo = config::Echo::strip;
  for (config::Device& device : line.devices) {
    device.protocol = line.protocol;
    device.poll = kFastPeriod;
    device.slow = kSlowPeriod;
  }
  LearnTruth(setup);
  store_ = std::make_unique<bus::PointStore>(config_);
  weak_ = std::make_unique<WeakChecksums>(setup_, line.devices.front().options);
  tools::SimulatorOptions options;
  options.link = port;
  options.pace = line.serial;
  options.faults = Standing();
  options.observer = [this](View request, View reply, View delivered) {
    weak_->OnDelivery(request, reply, delivered);
  };
  RunIn(world_, [&] {
    auto simulator = tools::Simulator::Create(world_, *setup.protocol, line.devices, options);
    if (!simulator) ADD_FAILURE() << simulator.error();
    if (simulator) simulator_ = std::move(*simulator);
  });
  const protocols::Protocol& protocol = *setup.protocol;
  runner_ = std::make_unique<lines::LineRunner>(
      loop_.io(), store_->LineAt(0), 0,
      [&protocol](const std::string&) -> const protocols::Protocol& { return protocol; }, *store_);
  loop_.Start();
  runner_->Start();
}

SoakLine::~SoakLine() {
  runner_->Stop();
  RunIn(world_, [this] { simulator_.reset(); });
}

void SoakLine::LearnTruth(const protocols::Setup& setup) {
  protocols::Rig rig(setup);
  rig.LearnTruth();
  auto& devices = config_.lines.front().devices;
  versions_.resize(devices.size());
  for (std::uint32_t i = 0; i < devices.size(); ++i) {
    auto& points = devices[i].points;
    for (std::size_t point = 0; point < points.size(); ++point) {
      Pin(points[point], rig->twin(i).values.Get(point, {}));
    }
    truth_.emplace_back();
    rig->store().Read(i, [&](const bus::DeviceRecord& record) {
      for (const bus::PointRecord& point : record.points) truth_.back().push_back(point.value);
    });
    told_.emplace_back(points.size());
  }
}

bool SoakLine::AllGood() const {
  bool all = true;
  for (std::uint32_t device = 0; device < store_->device_count(); ++device) {
    store_->Read(device, [&](const bus::DeviceRecord& record) {
      const Instant now = std::chrono::steady_clock::now();
      for (std::size_t i = 0; i < record.points.size() && all; ++i) {
        all = IsGood(QualityAt(record, i, now));
      }
    });
  }
  return all;
}

namespace {

bool IsClock(const config::Point& point) { return point.read.starts_with("04 00"); }

}  // namespace

void SoakLine::CompareWithTruth() {
  for (std::uint32_t device = 0; device < store_->device_count(); ++device) {
    store_->Read(device, [&](const bus::DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        if (IsClock(record.device->points[i])) continue;
        EXPECT_EQ(ToText(record.points[i].value), ToText(truth_[device][i]))
            << name() << " " << record.device->name << " " << record.device->points[i].name;
      }
    });
  }
}

std::vector<tools::Fault> SoakLine::Standing() const {
  if (!echoes_) return {};
  return {MakeFault("echo")};
}

void SoakLine::BeginFaults(Duration time) {
  const config::Timing times = setup_.protocol->timing(setup_.serial);
  const std::string too_late = FormatDuration(*times.reply + *times.drain / 2);
  const Duration turn = std::clamp<Duration>(time / 5, 8s, 1min);
  std::vector<tools::Fault> faults = Standing();
  const std::uint64_t seed = Crc16(ToBytes(name()));
  for (const std::string& text : {
           std::string("bits:rate=0.01,count=3"),
           std::string("loss:rate=0.01"),
           std::string("stall:rate=0.003"),
           std::string("dribble:rate=0.003,pause=5ms"),
           std::string("double:rate=0.003,pause=2ms"),
           std::string("garbage_before:rate=0.003"),
           std::string("garbage_after:rate=0.003"),
           "late:rate=0.003,delay=" + too_late,
           "death:after=" + FormatDuration(turn / 2) + ",for=" + FormatDuration(turn / 6) +
               ",every=" + FormatDuration(turn),
       }) {
    faults.push_back(MakeFault(text));
    faults.back().seed = seed;
  }
  RunIn(world_, [&] { simulator_->SetFaults(faults); });
}

void SoakLine::EndFaults() {
  RunIn(world_, [this] {
    struck_ = simulator_->fault_counts();
    simulator_->SetFaults(Standing());
  });
  if (echoes_) struck_.erase(struck_.begin());
}

void SoakLine::Check() {
  for (std::uint32_t device = 0; device < store_->device_count(); ++device) {
    store_->Read(device, [&](const bus::DeviceRecord& record) {
      if (std::exchange(versions_[device], record.version) == record.version) return;
      const Instant now = std::chrono::steady_clock::now();
      for (std::size_t i = 0; i < record.points.size(); ++i) CheckPoint(record, device, i, now);
    });
  }
}

void SoakLine::CheckPoint(const bus::DeviceRecord& record, std::uint32_t device, std::size_t point,
                          Instant now) {
  if (IsClock(record.device->points[point])) return;
  const bus::PointRecord& shown = record.points[point];
  const Value& truth = truth_[device][point];
  if (IsBad(QualityAt(record, point, now)) || shown.value == truth) return;
  if (std::exchange(told_[device][point], shown.seq) == shown.seq) return;
  const Duration longest = *setup_.protocol->timing(setup_.serial).ceiling;
  if (shown.read_at && weak_->MayHaveReached(*shown.read_at, longest)) {
    ++excused_;
    return;
  }
  if (++wrong_ > kMostTold) return;
  ADD_FAILURE() << name() << " " << record.device->name << " " << record.device->points[point].name
                << " shows " << ToText(shown.value) << " in place of " << ToText(truth);
}

void SoakLine::ExpectProgress() {
  const std::uint64_t before = std::exchange(exchanges_, store_->ReadLine(0).exchanges);
  EXPECT_GT(exchanges_, before) << name() << ": the line is stuck";
}

std::uint64_t SoakLine::struck() const {
  return std::accumulate(
      struck_.begin(), struck_.end(), std::uint64_t{},
      [](std::uint64_t sum, const tools::FaultCount& count) { return sum + count.struck; });
}

void SoakLine::PrintSummary() const {
  const bus::LineStatus status = store_->ReadLine(0);
  std::string outcomes;
  for (std::size_t i = 0; i < kOutcomeCount; ++i) {
    if (status.outcomes[i] == 0) continue;
    outcomes += fmt::format(" {} {}", Name(static_cast<Outcome>(i)), status.outcomes[i]);
  }
  std::string faults;
  for (const tools::FaultCount& count : struck_) {
    faults += fmt::format(" {} {}/{}", count.fault.substr(0, count.fault.find(':')), count.struck,
                          count.exchanges);
  }
  fmt::print(
      "{}{}: {} exchanges:{}; late {}; struck:{}; damage with a good check value: {}, values from "
      "it: {}; other wrong values: {}\n",
      name(), echoes_ ? " (echo: strip)" : "", status.exchanges, outcomes, status.late, faults,
      weak_->count(), excused_, wrong_);
}

}  // namespace baudgate
