// SPDX-License-Identifier: Apache-2.0
#include "gateway/lanes/lanes.h"

#include <fmt/format.h>

#include <algorithm>

namespace baudgate {
namespace {

config::Line PartOf(const config::Line& line, std::size_t begin, std::size_t end) {
  config::Line part = line;
  part.devices.assign(line.devices.begin() + static_cast<std::ptrdiff_t>(begin),
                      line.devices.begin() + static_cast<std::ptrdiff_t>(end));
  return part;
}

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> PartDevices(
    const std::vector<config::Device>& devices, std::size_t lanes) {
  const auto last_of = [&](std::size_t device) {  // behind all that have its address
    const auto same = std::find_if(devices.rbegin(), devices.rend(), [&](const auto& other) {
      return other.address == devices[device].address;
    });
    return static_cast<std::size_t>(devices.rend() - same);
  };
  std::vector<std::pair<std::size_t, std::size_t>> parts;
  std::size_t begin = 0;
  while (begin < devices.size() && parts.size() < lanes) {
    const std::size_t left = lanes - parts.size();
    std::size_t end = begin + (devices.size() - begin + left - 1) / left;
    for (std::size_t device = begin; device < end; ++device) end = std::max(end, last_of(device));
    parts.emplace_back(begin, end);
    begin = end;
  }
  return parts;
}

/// A poller with its part of the line.
class Lanes::Lane final : public PollerListener {
 public:
  Lane(Lanes& all, std::size_t number, std::pair<std::size_t, std::size_t> part)
      : line(PartOf(all.line_, part.first, part.second)),
        first(all.first_device_ + static_cast<std::uint32_t>(part.first)),
        all_(all),
        number_(number) {
    all.store_.AddLane(all.line_, line);
    poller = std::make_unique<Poller>(line, first, all.find_, all.store_, *this);
    poller->Attach(tap);
  }

  const config::Line line;
  const std::uint32_t first;  // of its devices, in the store
  LaneTap tap;
  std::unique_ptr<Poller> poller;

 private:
  void Send(View bytes, const config::SerialSettings&) override {
    all_.pipeline_->OnRequest(number_, bytes, all_.now_.instant);
  }
  void OnNoReply() override {
    all_.pipeline_->OnNoReply(number_, all_.now_.instant);
    all_.listener_.OnNoReply();
  }
  void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                     const std::string& reason) override {
    all_.listener_.OnDeviceState(device, from, to, reason);
  }
  void OnMemory(std::uint32_t device, const std::string& memory) override {
    all_.listener_.OnMemory(device, memory);
  }
  void OnEvents(ReportedEvents events) override { all_.listener_.OnEvents(std::move(events)); }
  void OnDrained(std::uint32_t device, Instant asked) override {
    all_.listener_.OnDrained(device, asked);
  }
  void OnNews(News news) override { all_.listener_.OnNews(std::move(news)); }
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override {
    all_.listener_.OnRead(device, points, at);
  }
  void OnWarning(std::uint32_t device, const std::string& message) override {
    all_.listener_.OnWarning(device, message);
  }

  Lanes& all_;
  const std::size_t number_;
};

Lanes::Lanes(const config::Line& line, std::uint32_t first_device, const Poller::FindProtocol& find,
             PointStore& store, PollerListener& listener)
    : line_(line), first_device_(first_device), find_(find), store_(store), listener_(listener) {
  const auto parts = PartDevices(line.devices, static_cast<std::size_t>(line.pipeline));
  if (parts.size() < 2) {
    MakeOne();
    return;
  }
  pipeline_.emplace(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    lanes_.push_back(std::make_unique<Lane>(*this, i, parts[i]));
    pollers_.push_back(lanes_.back()->poller.get());
  }
}

Lanes::~Lanes() = default;

void Lanes::MakeOne() {
  only_ = std::make_unique<Poller>(line_, first_device_, find_, store_, listener_);
  pollers_ = {only_.get()};
}

void Lanes::Attach(Tap& tap) {
  tap_ = &tap;
  if (only_) only_->Attach(tap);
  for (const auto& lane : lanes_) lane->tap.Attach(tap);
}

void Lanes::Recall(std::uint32_t device, std::string memory, Now now) {
  now_ = now;
  PollerOf(device).Recall(device, std::move(memory), now);
}

Poller& Lanes::PollerOf(std::uint32_t device) {
  std::size_t lane = 0;
  while (lane + 1 < lanes_.size() && lanes_[lane + 1]->first <= device) ++lane;
  return *pollers_[lane];
}

// ---------------------------------------------------------------- the connection

void Lanes::OnOpened(Now now, bool keeps_bit_rate) {
  now_ = now;
  if (pipeline_) pipeline_->OnOpened();
  for (Poller* poller : pollers_) poller->OnOpened(now, keeps_bit_rate);
  SendOut();
}

void Lanes::OnClosed(Now now, Override why) {
  now_ = now;
  for (Poller* poller : pollers_) poller->OnClosed(now, why);
  for (const auto& lane : lanes_) lane->tap.Flush();
}

void Lanes::OnLost(Now now) {
  if (pipeline_) pipeline_->OnLost(now.instant);
}

void Lanes::OnBytes(View bytes, Now now) {
  now_ = now;
  if (!pipeline_) return only_->OnBytes(bytes, now);
  for (const auto& [lane, message] : pipeline_->OnBytes(bytes, now.instant)) {
    pollers_[lane]->OnBytes(message, now);
  }
  SendOut();
}

void Lanes::OnTimer(Now now) {
  now_ = now;
  if (pipeline_) pipeline_->OnTimer(now.instant);
  for (Poller* poller : pollers_) {
    const auto due = poller->Deadline();
    if (due && *due <= now.instant) poller->OnTimer(now);
  }
  SendOut();
}

void Lanes::SendOut() {
  if (!pipeline_) return;
  for (const Bytes& request : pipeline_->TakeOut()) listener_.Send(request, line_.serial);
}

std::optional<Instant> Lanes::Deadline() const {
  std::optional<Instant> soonest;
  if (pipeline_) soonest = pipeline_->Deadline();
  for (const Poller* poller : pollers_) {
    const auto due = poller->Deadline();
    if (due && (!soonest || *due < *soonest)) soonest = due;
  }
  return soonest;
}

void Lanes::Narrow(Now now) {
  now_ = now;
  verdict_ = pipeline_->verdict();
  pollers_.clear();
  for (const auto& lane : lanes_) {
    lane->poller.reset();
    // Its counters stay; it is not busy any more.
    store_.UpdateLine(store_.LineIndex(lane->line), [](LineStatus& status) {
      status.use = 0;
      status.notice_bound = {};
    });
  }
  pipeline_.reset();
  retired_.swap(lanes_);
  MakeOne();
  if (tap_ != nullptr) only_->Attach(*tap_);
  for (const auto& [device, in_use] : in_use_) {
    const config::Device& its = line_.devices[device - first_device_];
    if (its.enabled != in_use) only_->SetInUse(device, in_use, now);
  }
}

std::string Lanes::Describe() const {
  if (pipeline_) return fmt::format("up to {} requests at a time", lanes_.size());
  return verdict_.empty() ? std::string() : "one request at a time: " + verdict_;
}

// ---------------------------------------------------------------- what is asked of its pollers

void Lanes::Submit(WriteCommand command, Now now) {
  now_ = now;
  PollerOf(command.device).Submit(std::move(command), now);
  SendOut();
}

/// No routes lead to several lanes: their protocol carries none.
void Lanes::Submit(RoutedRequest request, Now now) {
  now_ = now;
  pollers_.front()->Submit(std::move(request), now);
  SendOut();
}

void Lanes::Forget(std::uint64_t client, Now now) {
  now_ = now;
  for (Poller* poller : pollers_) poller->Forget(client, now);
  SendOut();
}

void Lanes::SetInUse(std::uint32_t device, bool in_use, Now now) {
  now_ = now;
  in_use_[device] = in_use;
  PollerOf(device).SetInUse(device, in_use, now);
  SendOut();
}

void Lanes::OnHostClock(bool right) {
  for (Poller* poller : pollers_) poller->OnHostClock(right);
}

void Lanes::OnEventsKept(std::uint32_t device, const std::string& said, Now now) {
  now_ = now;
  PollerOf(device).OnEventsKept(device, said, now);
  SendOut();
}

void Lanes::WindUp() {
  for (Poller* poller : pollers_) poller->WindUp();
}

bool Lanes::IsWriting() const {
  return std::ranges::any_of(pollers_, [](const Poller* poller) { return poller->IsWriting(); });
}

bool Lanes::SilentSince(Instant when) const {
  if (pipeline_ && pipeline_->HeardSince(when)) return false;
  return std::ranges::any_of(
      pollers_, [when](const Poller* poller) { return poller->ledger().SilentSince(when); });
}

}  // namespace baudgate
