// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/lanes/lanes_rig.h"

#include <algorithm>

#include "config/catalog/option_values.h"
#include "gateway/modbus/wire/mbap.h"

namespace baudgate {
namespace {

config::Point PointOf(int number) {
  config::Point point;
  point.name = "p" + std::to_string(number);
  point.read = "holding " + std::to_string(20 * number);  // a request each
  point.write = point.read;
  point.type = config::Type::uint16;
  point.access = config::Access::read_write;
  return point;
}

}  // namespace

class LanesRig::Port final : public Transport {
 public:
  explicit Port(LanesRig& rig) : rig_(rig) {}
  void Open() override { rig_.opening_ = rig_.now_.instant + 5ms; }
  void Close() override {
    is_open_ = false;
    rig_.opening_.reset();
    rig_.coming_.clear();
  }
  bool is_open() const override { return is_open_; }
  void Send(View bytes) override { rig_.to_server_.emplace_back(bytes.begin(), bytes.end()); }
  void DropUnsent() override {}
  Status Apply(const config::SerialSettings&) override { return {}; }
  std::string Describe() const override { return "fake"; }

  bool is_open_ = false;

 private:
  LanesRig& rig_;
};

LanesRig::LanesRig(int devices, int pipeline, const std::function<void(config::Line&)>& change) {
  config::Line line;
  line.name = "plc";
  line.port = "tcp://10.0.0.9:502";
  line.protocol = "modbus_tcp";
  line.tcp = true;
  line.serial = ModbusTcpProtocol().serial;
  line.pipeline = pipeline;
  for (int i = 0; i < devices; ++i) {
    config::Device device;
    device.name = "d" + std::to_string(i);
    device.address = std::to_string(kFirstUnit + i);
    device.protocol = line.protocol;
    device.poll = 100ms;
    device.options = config::DefaultOptions(ModbusTcpProtocol());
    for (int point = 0; point < kPoints; ++point) device.points.push_back(PointOf(point));
    line.devices.push_back(std::move(device));
  }
  if (change) change(line);
  config_.lines.push_back(std::move(line));
  for (std::size_t i = 0; i < config_.lines[0].devices.size(); ++i) {
    values_.push_back(std::make_unique<FixedValues>());
    for (std::uint32_t point = 0; point < kPoints; ++point) {
      values_.back()->Set(point, Truth(static_cast<std::uint32_t>(i), point));
    }
    twins_.push_back(ModbusTcpProtocol().make_twin(config_.lines[0].devices[i], *values_.back()));
  }
  store_ = std::make_unique<PointStore>(config_);
  port_ = std::make_unique<Port>(*this);
  driver_ = std::make_unique<LineDriver>(
      config_.lines[0], 0U,
      [](const std::string&) -> const Protocol& { return ModbusTcpProtocol(); }, *store_, *port_,
      *this, LineRecorder::Sink());
}

LanesRig::~LanesRig() = default;

void LanesRig::Start() { driver_->Start(now_); }

bool LanesRig::OnDown(const std::string&) {
  reopen_ = now_.instant + 1s;
  return true;
}

void LanesRig::CloseByServer() {
  port_->Close();
  driver_->OnLost("closed by the server", now_);
}

// ---------------------------------------------------------------- the server

Bytes LanesRig::AnswerOf(const Bytes& request) {
  const auto device = static_cast<std::uint32_t>(request[6] - kFirstUnit);
  if (device >= twins_.size() || dead.contains(device)) return {};
  if (request[7] == 6) ++wire[device];
  return twins_[device]->Answer(request, now_.instant);
}

void LanesRig::Take(const Bytes& request) {
  using Kind = ServerManner::Kind;
  ++asked;
  const auto under_way = static_cast<std::size_t>(
      std::ranges::count_if(coming_, [](const auto& one) { return !one.second.reply.empty(); }));
  most_under_way_ = std::max(most_under_way_, under_way + 1);
  if (!there) return;
  if (manner.kind == Kind::closes && under_way > 0) return CloseByServer();
  if (manner.kind == Kind::first_only && under_way > 0) return;
  Bytes reply = AnswerOf(request);
  if (reply.empty()) return;
  Instant at = now_.instant + manner.think;
  switch (manner.kind) {
    case Kind::shuffled:
      at = now_.instant + manner.think * static_cast<int>(random_() % 100) / 100;
      break;
    case Kind::one_by_one:
      at = busy_until_ = std::max(busy_until_, now_.instant) + manner.think;
      break;
    case Kind::refuses:
      if (under_way > 0) {
        reply.resize(7);
        reply[5] = 3;
        reply.push_back(static_cast<std::uint8_t>(request[7] | 0x80));
        reply.push_back(6);
        at = now_.instant + 1ms;
      }
      break;
    case Kind::swaps:
    case Kind::repeats: {
      Bytes number(reply.begin(), reply.begin() + 2);
      if (!last_number_.empty() && (manner.kind == Kind::repeats || under_way > 0)) {
        std::ranges::copy(last_number_, reply.begin());
      }
      last_number_ = number;
      break;
    }
    default:
      break;
  }
  coming_.emplace(at, Coming{std::move(reply), connection_});
}

// ---------------------------------------------------------------- time

void LanesRig::GoTo(Instant instant) {
  now_.wall += instant - now_.instant;
  now_.instant = instant;
}

bool LanesRig::Step(Instant until) {
  if (!to_server_.empty()) {
    const Bytes request = to_server_.front();
    to_server_.erase(to_server_.begin());
    if (port_->is_open_) Take(request);
    return true;
  }
  std::optional<Instant> next = driver_->Deadline();
  const auto sooner = [&next](std::optional<Instant> at) {
    if (at && (!next || *at < *next)) next = at;
  };
  sooner(reopen_);
  sooner(opening_);
  if (!coming_.empty()) sooner(coming_.begin()->first);
  if (!next || *next > until) return false;
  GoTo(std::max(now_.instant, *next));
  if (!coming_.empty() && coming_.begin()->first <= now_.instant) {
    const Bytes reply = coming_.begin()->second.reply;
    coming_.erase(coming_.begin());
    driver_->OnBytes(reply, now_);
    Check();
  } else if (opening_ && *opening_ <= now_.instant) {
    opening_.reset();
    if (!there) {
      driver_->OnOpenFailed("nobody there", now_);
    } else {
      ++opens;
      ++connection_;
      busy_until_ = {};
      last_number_.clear();
      port_->is_open_ = true;
      driver_->OnOpened(now_);
    }
  } else if (reopen_ && *reopen_ <= now_.instant) {
    reopen_.reset();
    port_->Open();
  } else {
    driver_->OnTimer(now_);
  }
  return true;
}

void LanesRig::RunFor(Duration time) {
  RunUntil([] { return false; }, time);
}

bool LanesRig::RunUntil(const std::function<bool()>& done, Duration limit) {
  const Instant until = now_.instant + limit;
  while (!done()) {
    if (!Step(until)) {
      GoTo(until);
      return done();
    }
  }
  return true;
}

/// Points that are written are told by the thousands of their values.
void LanesRig::Check() {
  for (std::uint32_t device = 0; device < store_->device_count(); ++device) {
    store_->Read(device, [&](const DeviceRecord& record) {
      for (std::uint32_t point = 0; point < kPoints; ++point) {
        if (!record.points[point].read_at || IsBad(QualityAt(record, point, now_.instant)))
          continue;
        const double shown = ToDouble(record.points[point].value);
        const bool right = point == 0 ? static_cast<std::uint32_t>(shown / 1000) == device + 1
                                      : shown == Truth(device, point);
        wrong += right ? 0 : 1;
      }
    });
  }
}

bool LanesRig::Good(std::uint32_t device) {
  bool good = true;
  store_->Read(device, [&](const DeviceRecord& record) {
    for (std::size_t point = 0; point < kPoints; ++point) {
      good = good && IsGood(QualityAt(record, point, now_.instant));
    }
  });
  return good;
}

bool LanesRig::AllGood() {
  for (std::uint32_t device = 0; device < store_->device_count(); ++device) {
    if (!Good(device)) return false;
  }
  return true;
}

DeviceStatus LanesRig::StatusOf(std::uint32_t device) const {
  DeviceStatus status;
  store_->Read(device, [&](const DeviceRecord& record) { status = record.status; });
  return status;
}

void LanesRig::Write(std::uint32_t device, double value, Duration within) {
  WriteCommand command;
  command.device = device;
  command.writes.push_back({0, Value(value)});
  command.deadline = now_.instant + within;
  command.done = [this](const WriteResult& result) { ends.push_back(result.end); };
  driver_->Submit(std::move(command), now_);
}

}  // namespace baudgate
