// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/lag_rig.h"

#include <algorithm>
#include <utility>

#include "gateway/line/assembler.h"

namespace baudgate {
namespace {

config::Line Changed(config::Line line, const std::function<void(config::Line&)>& change) {
  if (change) change(line);
  return line;
}

std::vector<const config::Device*> All(const config::Line& line,
                                       const std::vector<config::Device>& strangers) {
  std::vector<const config::Device*> all;
  for (const config::Device& device : line.devices) all.push_back(&device);
  for (const config::Device& device : strangers) all.push_back(&device);
  return all;
}

/// Two for each device: one like it, one of another identity.
std::vector<config::Device> StrangersOf(const LagCase& which, const config::Line& line) {
  std::vector<config::Device> strangers;
  for (const config::Device& device : line.devices) {
    for (const bool other : {false, true}) strangers.push_back(StrangerOf(which, device, other));
    for (std::size_t i = strangers.size() - 2; i < strangers.size(); ++i)
      strangers[i].protocol = line.protocol;
  }
  return strangers;
}

}  // namespace

LagRig::LagRig(const LagCase& which, unsigned seed,
               const std::function<void(config::Line&)>& change)
    : which_(which),
      config_(Changed(LagLineOf(which), change)),
      strangers_(StrangersOf(which, config_)),
      server_({which.setup.serial, true, 5ms}, seed),
      twins_(3 * config_.devices.size()) {
  const std::vector<const config::Device*> all = All(config_, strangers_);
  code_ = std::make_unique<BirthCode>(which.setup.protocol->name, all);
  line_ = std::make_unique<VirtualLine>(config_, std::vector{which.setup.protocol}, strangers_);
  line_->keep_sent = false;
  for (std::size_t twin = 0; twin < all.size(); ++twin) {
    values_.push_back(
        std::make_unique<BirthValues>(*code_, twin, [this] { return line_->now().instant; }));
    line_->twin(twin).values.instead = values_.back().get();
    line_->twin(twin).manner.dead = twin >= devices();
    line_->twin(twin).manner.instead = [this, twin](View request) {
      return Instead(twin, request);
    };
  }
  for (std::uint32_t device = 0; device < devices(); ++device) answers_.push_back(device);
  oracle_ = std::make_unique<BirthOracle>(*line_, *code_, values_);
  oracle_->excuse = [this](std::uint32_t device) { return IsBeyondDetection(device); };
  line_->server = [this](View request, Bytes reply, Instant end) {
    return server_.OnRequest(request, std::move(reply), end);
  };
  line_->always = [this] { oracle_->Look(); };
}

void LagRig::Open() {
  line_->Open();
  const auto all_good = [this] {
    bool good = true;
    for (std::uint32_t device = 0; device < devices() && good; ++device) {
      for (std::uint32_t i = 0; i < config_.devices[device].points.size() && good; ++i)
        good = IsGood(line_->QualityOf(device, i));
    }
    return good;
  };
  EXPECT_TRUE(line_->RunUntil(all_good, 2min)) << which_.name() << ": not every point became good";
}

Duration LagRig::ceiling() const {
  const Protocol& protocol = *which_.setup.protocol;
  return *config::Resolve(config_.devices[0].timing, protocol.timing(which_.setup.serial)).ceiling;
}

/// What the twin says in place of its reply; nothing: that stands.
std::optional<Bytes> LagRig::Instead(std::size_t twin, View request) {
  TwinState& state = twins_[twin];
  const Instant now = line_->now().instant;
  if (state.off) {
    state.missed = true;
    return Bytes();
  }
  if (now < state.silent_until) return Bytes();
  if (std::exchange(state.writes, values_[twin]->writes()) != values_[twin]->writes()) {
    state.silent_until = now + silent_after_write;
  }
  const std::size_t device = twin < devices() ? twin : (twin - devices()) / 2;
  return SayIdentification(which_, config_.devices[device], request, state.told_apart);
}

void LagRig::Replace(std::uint32_t device, Duration off, bool other_identity) {
  const std::size_t before = answers_[device];
  twins_[before].off = true;
  const Naming naming = NamingOf(which_, config_.devices[device]);
  const bool other = other_identity && naming != Naming::none;
  const std::size_t after = devices() + 2 * device + (other ? 1 : 0);
  if (after == before) return;
  answers_[device] = after;
  changes_.push_back({line_->now().instant + off, [this, device, before, after, other, naming] {
                        line_->twin(before).manner.dead = true;
                        line_->twin(after).manner.dead = false;
                        twins_[after].told_apart = other;
                        oracle_->Replace(device, after, other && naming == Naming::demanded);
                        if (other && twins_[before].missed) oracle_->ForbidMixture(device);
                      }});
}

bool LagRig::Write(std::uint32_t device) {
  const auto point = WritablePoint(config_.devices[device]);
  if (!point) return false;
  const Value value = values_[answers_[device]]->Fresh(*point);
  WriteCommand command;
  command.device = device;
  command.writes.push_back({*point, value});
  command.deadline = line_->now().instant + 10s;
  command.done = [this, device, point, value](Outcome outcome, const std::string&) {
    if (outcome != Outcome::ok) return;
    ++confirmed_;
    oracle_->Confirm(device, *point, ToDouble(value));
  };
  return line_->Submit(std::move(command));
}

void LagRig::RunFor(Duration time) {
  const Instant until = line_->now().instant + time;
  while (true) {
    const auto next = std::ranges::min_element(changes_, {}, &Change::at);
    if (next == changes_.end() || next->at > until) break;
    const Change change = std::move(*next);
    changes_.erase(next);
    if (change.at > line_->now().instant) line_->RunFor(change.at - line_->now().instant);
    change.what();
  }
  if (until > line_->now().instant) line_->RunFor(until - line_->now().instant);
}

/// In what has arrived of late stands a frame with a good check value that no device has said.
bool LagRig::IsBeyondDetection(std::uint32_t device) {
  const Protocol& protocol = *which_.setup.protocol;
  const Instant now = line_->now().instant;
  Bytes stream;
  bool spoilt = false;
  for (const LaggingServer::Arrival& one : server_.arrivals()) {
    if (one.at > now || one.at < now - 2 * ceiling()) continue;
    spoilt = spoilt || one.spoilt;
    Append(stream, one.bytes);
  }
  if (!spoilt) return false;
  const auto& said = server_.said();
  for (const Bytes& request : server_.requests()) {
    for (std::size_t at = 0; at < stream.size(); ++at) {
      Assembler assembler;
      assembler.Begin(protocol.reply_rule,
                      protocol.expect(request, config_.devices[device].options));
      assembler.Feed(View(stream).subspan(at));
      auto frame = assembler.Next(false);
      if (!frame) frame = assembler.Next(true);
      if (!frame || !which_.setup.good_checksum(*frame)) continue;
      const auto is_same = [&](const Bytes& one) {
        return std::ranges::search(one, *frame).begin() != one.end();
      };
      if (std::ranges::none_of(said, is_same)) return true;
    }
  }
  return false;
}

}  // namespace baudgate
