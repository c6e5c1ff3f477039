// `LinePortTest`: a line under virtual time, on a port that the test controls.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/lines/line_runner.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate::lines {

class LoosePort final : public transports::Transport {
 public:
  void Open() override {
    ++opens;
    opens_by_itself = open_on_demand;
  }
  void Close() override { open = false; }
  bool is_open() const override { return open; }
  void Send(View bytes) override {
    sent.emplace_back(bytes.begin(), bytes.end());
    last = sent.back();
    ++sends;
  }
  void DropUnsent() override {}
  Status Apply(const config::SerialSettings&) override {
    ++applied;
    return refuses ? Status(Error{"refused"}) : Status();
  }
  Status Reset(const config::SerialSettings&) override {
    ++resets;
    sent.clear();
    return refuses ? Status(Error{"refused"}) : Status();
  }
  std::optional<std::string> Restore() override { return std::exchange(changed, {}); }
  std::string Describe() const override { return "fake"; }

  int opens = 0;
  int resets = 0;
  int applied = 0;
  int sends = 0;
  Bytes last;
  bool refuses = false;
  bool open = false;
  bool open_on_demand = false;
  bool opens_by_itself = false;
  std::deque<Bytes> sent;
  std::optional<std::string> changed;  // settings that another program has changed
};

class FakeRetries final : public transports::PortRetries {
 public:
  void OnOpened() override {}
  void OnWorked() override { ++worked; }
  bool OnDown(const std::string& reason) override {
    downs.push_back(reason);
    return true;
  }
  void Stop() override { ++stops; }

  int worked = 0;
  int stops = 0;
  std::vector<std::string> downs;
};

class NewsSink final : public bus::EventSink {
 public:
  void OnReported(bus::ReportedEvents) override {}
  void OnDrained(std::uint32_t, Instant) override {}
  void OnNews(const config::Line&, const bus::News& one, Now) override {
    if (!one.first) news.emplace_back(one.what, one.over);
  }
  void OnRead(std::uint32_t, std::span<const std::uint32_t> points, Now) override {
    read.insert(points.begin(), points.end());
  }

  std::vector<std::pair<bus::News::What, bool>> news;
  std::set<std::uint32_t> read;
};

class LinePortTest : public testing::Test {
 protected:
  explicit LinePortTest(const std::string& port = "tcp://server:4001",
                        std::vector<config::Device> devices = {ToyDevice("a", "A", {"1"})}) {
    config_.lines.push_back(ToyLine(std::move(devices)));
    config_.lines[0].port = port;
    store_ = std::make_unique<bus::PointStore>(config_);
    twin_ = ToyProtocol().make_twin(config_.lines[0].devices.back(), values_);
    line_ = std::make_unique<LineParts>(
        config_.lines[0], 0U,
        [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); }, *store_,
        port_, retries_, LineParts::Links{.events = &sink_});
    line_->Start(now_);
  }

  /// Handles an input in the same way as LineRunner.
  template <typename Input>
  void Handle(Input input) {
    input();
    line_->Settle(now_);
  }
  void Open() {
    port_.open = true;
    Handle([&] { line_->port.OnOpened(now_); });
  }
  void Lose(const std::string& reason) {
    port_.open = false;
    Handle([&] { line_->port.OnLost(reason, now_); });
  }
  void End() {
    port_.open = false;
    port_.sent.clear();
    Handle([&] { line_->port.OnEnded("closed", false, now_); });
  }
  void Say(std::string_view text) {
    Handle([&] { line_->port.PassOn(ToBytes(text), now_); });
  }
  void Pass(Duration time) {
    const Instant until = now_.instant + time;
    for (;;) {
      if (std::exchange(port_.opens_by_itself, false)) {
        GoTo(now_.instant + 1ms);
        Open();
        continue;
      }
      if (!port_.sent.empty()) {
        const Bytes request = port_.sent.front();
        port_.sent.pop_front();
        if (!answers_) continue;
        if (closes_for_.contains(request[1])) {
          End();
          continue;
        }
        GoTo(now_.instant + 30ms);
        Handle([&] { line_->port.PassOn(twin_->Answer(request, now_.instant), now_); });
        if (closes_) End();
        continue;
      }
      const auto deadline = line_->Deadline();
      if (!deadline || *deadline > until) break;
      GoTo(std::max(now_.instant, *deadline));
      Handle([&] { line_->OnTimer(now_); });
    }
    GoTo(std::max(now_.instant, until));
  }
  void Stop(Duration time) { GoTo(now_.instant + time); }
  bus::LineStatus status() { return store_->ReadLine(0); }
  void Write(Duration patience = 1h) {
    bus::WriteCommand command;
    command.kind = bus::Writes{{0, 5.0, {}, 5.0}};
    command.deadline = now_.instant + patience;
    command.abandoned = left_;
    command.done = [this](const WriteResult& result) { ends_.push_back(result.end); };
    Handle([&] { line_->Submit(std::move(command), now_); });
  }

  std::shared_ptr<bus::Telegram> Ask(std::string_view text, Duration patience = 5s) {
    auto telegram = std::make_shared<bus::Telegram>();
    telegram->bytes = ToBytes(text);
    bus::WriteCommand command;
    command.kind = telegram;
    command.deadline = now_.instant + patience;
    command.abandoned = left_;
    command.done = [this](const WriteResult& result) { ends_.push_back(result.end); };
    Handle([&] { line_->Submit(std::move(command), now_); });
    return telegram;
  }

  config::Config config_;
  std::unique_ptr<bus::PointStore> store_;
  FixedValues values_ = ToyValues();
  std::unique_ptr<protocols::Twin> twin_;
  bool answers_ = true;
  bool closes_ = false;  // the server closes the connection after each answer
  // The server closes the connection in place of answering these addresses.
  std::set<std::uint8_t> closes_for_;
  LoosePort port_;
  FakeRetries retries_;
  NewsSink sink_;
  std::unique_ptr<LineParts> line_;
  Now now_{Instant() + 1h, WallTime(1'790'000'000s)};
  std::vector<WriteEnd> ends_;
  std::shared_ptr<std::atomic<bool>> left_ = std::make_shared<std::atomic<bool>>(false);

 private:
  void GoTo(Instant instant) {
    now_.wall += instant - now_.instant;
    now_.instant = instant;
  }
};

struct LocalPort : LinePortTest {
  LocalPort() : LinePortTest("/dev/ttyUSB0") {}
};

}  // namespace baudgate::lines
