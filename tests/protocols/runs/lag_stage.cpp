// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/lag_stage.h"

#include <algorithm>
#include <utility>

#include "gateway/bus/points/point_store.h"
#include "protocols/assembler.h"

namespace baudgate::protocols {
namespace {

constexpr int kLongestReply = 150;  // in characters

config::Line WithProtocol(config::Line line) {
  for (config::Device& device : line.devices) device.protocol = line.protocol;
  return line;
}

std::vector<const config::Device*> All(const config::Line& line,
                                       const std::vector<config::Device>& strangers) {
  std::vector<const config::Device*> all;
  for (const config::Device& device : line.devices) all.push_back(&device);
  for (const config::Device& device : strangers) all.push_back(&device);
  return all;
}

std::vector<config::Device> StrangersOf(const LagCase& which, const config::Line& line) {
  std::vector<config::Device> strangers;
  for (const config::Device& device : line.devices) {
    for (const bool other : {false, true}) strangers.push_back(StrangerOf(which, device, other));
  }
  return strangers;
}

}  // namespace

LagStage::LagStage(const LagCase& which, unsigned seed, config::Line line)
    : which_(which),
      line_(WithProtocol(std::move(line))),
      strangers_(StrangersOf(which, line_)),
      server_({which.setup.serial, true, 5ms}, seed),
      code_(which.setup.protocol->name, All(line_, strangers_)),
      twins_(3 * line_.devices.size()) {
  for (std::size_t twin = 0; twin < twins_.size(); ++twin) {
    values_.push_back(std::make_unique<BirthValues>(code_, twin, [this] { return NowOnStage(); }));
    twins_[twin].there = twin < devices();
  }
  for (std::uint32_t device = 0; device < devices(); ++device) answers_.push_back(device);
}

void LagStage::Judge(const bus::PointStore& store) {
  store_ = &store;
  oracle_ = std::make_unique<BirthOracle>(
      store, [this] { return NowOnStage(); }, code_, values_);
  oracle_->excuse = [this](std::uint32_t device) { return IsBeyondDetection(device); };
}

bool LagStage::AllGood() const {
  bool good = true;
  for (std::uint32_t device = 0; device < devices() && good; ++device) {
    store_->Read(device, [&](const bus::DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size() && good; ++i)
        good = IsGood(QualityAt(record, i, NowOnStage()));
    });
  }
  return good;
}

Duration LagStage::ceiling() const {
  const Protocol& protocol = *which_.setup.protocol;
  return *config::Resolve(line_.devices[0].timing, protocol.timing(which_.setup.serial)).ceiling;
}

void LagStage::Suffer(Trouble trouble) {
  const Duration characters = kLongestReply * which_.setup.serial.CharacterTime();
  server_.faults = FaultsOf(trouble, ceiling() - characters);
}

std::optional<Bytes> LagStage::Instead(std::size_t twin, View request) {
  TwinState& state = twins_[twin];
  const Instant now = NowOnStage();
  if (state.off) {
    state.missed = true;
    return Bytes();
  }
  if (now < state.silent_until) return Bytes();
  if (std::exchange(state.writes, values_[twin]->writes()) != values_[twin]->writes()) {
    state.silent_until = now + silent_after_write;
  }
  const std::size_t device = twin < devices() ? twin : (twin - devices()) / 2;
  return SayIdentification(which_, line_.devices[device], request, state.told_apart);
}

void LagStage::Replace(std::uint32_t device, Duration off, bool other_identity) {
  const std::size_t before = answers_[device];
  bool other = other_identity && NamingOf(which_, line_.devices[device]) != Naming::none;
  std::size_t after = devices() + 2 * device + (other ? 1 : 0);
  if (after == before) {
    after = device;
    other = false;
  }
  twins_[before].off = true;
  answers_[device] = after;
  ++replaced_;
  replacements_.push_back({NowOnStage() + off, device, before, after, other});
  std::ranges::sort(replacements_, {}, &Replacement::at);
}

bool LagStage::IsForeign(std::uint32_t device) const {
  return twins_[answers_[device]].told_apart &&
         NamingOf(which_, line_.devices[device]) == Naming::demanded;
}

std::optional<Instant> LagStage::NextChange() const {
  if (replacements_.empty()) return std::nullopt;
  return replacements_.front().at;
}

void LagStage::Change() {
  const Replacement one = replacements_.front();
  replacements_.erase(replacements_.begin());
  TwinState& before = twins_[one.before];
  TwinState& after = twins_[one.after];
  const Naming naming = NamingOf(which_, line_.devices[one.device]);
  const bool differs = before.told_apart != one.other_identity;
  oracle_->Replace(one.device, one.after, one.other_identity && naming == Naming::demanded);
  if (differs && before.missed && naming == Naming::learned) oracle_->ForbidMixture(one.device);
  before.there = false;
  after.there = true;
  after.off = after.missed = false;
  after.told_apart = one.other_identity;
}

bool LagStage::Write(std::uint32_t device) {
  const auto point = WritablePoint(line_.devices[device]);
  if (!point) return false;
  const Value value = values_[answers_[device]]->Fresh(*point);
  bus::WriteCommand command;
  command.device = device;
  const config::Point& written = line_.devices[device].points[*point];
  command.kind = bus::Writes{{*point, value, {}, bus::ToSample(written, {*point, value}).value}};
  command.deadline = NowOnStage() + 10s;
  command.done = [this, device, point, value](const WriteResult& result) {
    if (result.end != WriteEnd::ok) return;
    ++confirmed_;
    oracle_->Confirm(device, *point, ToDouble(value));
  };
  return Submit(std::move(command));
}

bool LagStage::IsBeyondDetection(std::uint32_t device) {
  const Protocol& protocol = *which_.setup.protocol;
  const Instant now = NowOnStage();
  Bytes stream;
  std::vector<LaggingServer::Arrival> damaged;
  for (const LaggingServer::Arrival& one : server_.arrivals()) {
    if (one.at > now || one.at < now - 2 * ceiling()) continue;
    if (!one.intact.empty()) damaged.push_back(one);
    Append(stream, one.bytes);
  }
  if (damaged.empty()) return false;
  const auto& said = server_.said();
  for (const Bytes& request : server_.requests()) {
    for (std::size_t at = 0; at < stream.size(); ++at) {
      Assembler assembler;
      assembler.Begin(
          protocol.reply_rule,
          protocol.expect(request, ParseOptions(protocol, line_.devices[device].options)));
      assembler.Feed(View(stream).subspan(at));
      auto frame = assembler.Next(false);
      if (!frame) frame = assembler.Next(true);
      if (!frame || !which_.setup.good_checksum(*frame)) continue;
      const auto is_in = [&](const Bytes& one) {
        return std::ranges::search(one, *frame).begin() != one.end();
      };
      const auto was_made = [&](const LaggingServer::Arrival& one) {
        return is_in(one.bytes) && !is_in(one.intact);
      };
      if (std::ranges::none_of(said, is_in) || std::ranges::any_of(damaged, was_made)) return true;
    }
  }
  return false;
}

}  // namespace baudgate::protocols
