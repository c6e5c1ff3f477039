// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/lag_soak_line.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <asio/post.hpp>
#include <utility>

namespace baudgate {
namespace {

constexpr Duration kThink = 5ms;
constexpr Duration kDeeds = 1s;       // at most one write or replacement in this time
constexpr Duration kStaysFor = 1min;  // time until a second device of the line may be replaced
constexpr std::size_t kOneWriteIn = 10;
constexpr std::size_t kOneReplacementIn = 60;

config::Config ConfigOf(config::Line line, const std::string& name, const std::string& path) {
  line.name = name;
  line.port = path;
  config::Config config;
  config.lines.push_back(std::move(line));
  return config;
}

}  // namespace

LagSoakLine::LagSoakLine(const protocols::LagCase& which, unsigned seed, const std::string& path,
                         asio::io_context& world)
    : protocols::LagStage(which, seed, LagLineOf(which)),
      seed_(seed),
      random_(seed),
      world_(world),
      config_(ConfigOf(line_config(), which.name(), path)),
      store_(config_),
      port_(world, *which.setup.protocol, config_.lines[0].devices[0].options,
            {which.setup.serial, true, kThink}, path,
            [this](View request, Instant end) { return OnRequest(request, end); }),
      turn_began_(NowOnStage()) {
  if (OneOf(2) == 0) silent_after_write = 1400ms;
  twins_.resize(twins());
  MakeTwins();
  Judge(store_);
  const protocols::Protocol& protocol = *which.setup.protocol;
  runner_ = std::make_unique<lines::LineRunner>(
      loop_.io(), store_.LineAt(0), 0,
      [&protocol](const std::string&) -> const protocols::Protocol& { return protocol; }, store_);
  loop_.Start();
  runner_->Start();
}

Instant LagSoakLine::NowOnStage() const { return std::chrono::steady_clock::now(); }

/// The answer arrives on the line's thread, so it is posted to `world_`.
bool LagSoakLine::Submit(bus::WriteCommand command) {
  command.done = [&world = world_, done = std::move(command.done)](const WriteResult& result) {
    asio::post(world, [done, result] { done(result); });
  };
  return runner_->Submit(std::move(command));
}

void LagSoakLine::MakeTwins() {
  for (std::size_t twin = 0; twin < twins(); ++twin) {
    if (!IsThere(twin)) {
      twins_[twin].reset();
    } else if (!twins_[twin]) {
      const bool own = twin < devices();
      const config::Device& device =
          own ? config_.lines[0].devices[twin] : strangers()[twin - devices()];
      twins_[twin] = which().setup.protocol->make_twin(device, ValuesOf(twin));
    }
  }
}

std::vector<tools::TimedPiece> LagSoakLine::OnRequest(View request, Instant end) {
  Bytes said;
  for (std::size_t twin = 0; twin < twins(); ++twin) {
    if (!twins_[twin]) continue;
    Bytes reply = twins_[twin]->Answer(request, end);
    if (!reply.empty()) reply = Instead(twin, request).value_or(reply);
    Append(said, reply);
  }
  return server().OnRequest(request, std::move(said), end);
}

void LagSoakLine::BeginTroubles(Duration turn) {
  turn_ = turn;
  next_deed_ = NowOnStage();
  EndTurn();
  NextTurn();
}

void LagSoakLine::EndTroubles() {
  EndTurn();
  if (troubled_) NextTurn();
  turn_ends_ = next_deed_ = Instant::max();
}

void LagSoakLine::EndTurn() {
  const double time = std::chrono::duration<double>(NowOnStage() - turn_began_).count();
  Share& share = troubled_ ? troubled_share_ : quiet_share_;
  if (turn_ends_ == Instant::max()) return;
  share.good += time * oracle().Availability();
  share.all += time;
}

/// Begins the next turn: quiet and troubled turns alternate. Its length is 0.5 to 1.5 times
/// `turn_`.
void LagSoakLine::NextTurn() {
  troubled_ = !troubled_;
  turn_began_ = NowOnStage();
  turn_ends_ = turn_began_ + turn_ * static_cast<int>(50 + OneOf(100)) / 100;
  oracle().RestartAvailability();
  trouble_ = "quiet, after " + trouble_;
  server().faults = {};
  if (!troubled_) return;
  protocols::Trouble trouble{};
  do {
    trouble = static_cast<protocols::Trouble>(OneOf(protocols::kTroubles));
  } while (IsCopied(trouble) || (!which().CanProve() && IsBeyondProof(trouble)));
  trouble_ = Name(trouble);
  Suffer(trouble);
}

void LagSoakLine::DoSomething() {
  const auto device = static_cast<std::uint32_t>(OneOf(devices()));
  if (OneOf(kOneWriteIn) == 0) Write(device);
  if (!troubled_ || NextChange() || NowOnStage() < next_replacement_) return;
  if (OneOf(kOneReplacementIn) != 0) return;
  next_replacement_ = NowOnStage() + kStaysFor;
  Replace(device, 500ms + std::chrono::milliseconds(OneOf(4000)), OneOf(2) == 0);
}

bool LagSoakLine::IsReplacing() const {
  bool replacing = NextChange().has_value();
  for (std::uint32_t device = 0; device < devices(); ++device)
    replacing = replacing || IsForeign(device);
  return replacing;
}

void LagSoakLine::Look() {
  const Instant now = NowOnStage();
  while (NextChange() && *NextChange() <= now) {
    Change();
    MakeTwins();
  }
  if (now >= turn_ends_) {
    EndTurn();
    NextTurn();
  }
  // The points of a foreign device are never good. A quiet turn must have good points, so the
  // configured device comes back.
  for (std::uint32_t device = 0; device < devices() && !troubled_ && !NextChange(); ++device)
    if (IsForeign(device)) Replace(device, 500ms, false);
  if (now >= next_deed_) {
    next_deed_ = now + kDeeds;
    DoSomething();
  }
  oracle().Look();
  if (oracle().wrong() == 0 || std::exchange(told_, true)) return;
  ADD_FAILURE() << which().name() << ", seed " << seed_ << " (" << trouble_ << ", " << replaced()
                << " devices replaced): " << oracle().what() << "\n"
                << port_.Latest();
}

std::string LagSoakLine::Share::Text() const {
  return all > 0 ? fmt::format("{:.1f} %", 100 * good / all) : "none";
}

void LagSoakLine::PrintSummary() {
  fmt::print(
      "{}: {} exchanges, {} good readings judged, {} wrong, {} excused; good: {} in quiet, {} in "
      "troubled time; {} writes confirmed, {} devices replaced\n",
      which().name(), store_.ReadLine(0).exchanges, oracle().judged(), oracle().wrong(),
      oracle().excused(), quiet_share_.Text(), troubled_share_.Text(), confirmed(), replaced());
}

}  // namespace baudgate
