// `LineTest` brings a `Line` into any state, and records what the line reports.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/bus/exchange/line.h"
#include "tests/support/times.h"
#include "tests/support/toy_protocol.h"

namespace baudgate::bus {

using State = Line::State;

inline constexpr LineTimes kTimes = {
    .quiet = 5ms, .reply = 100ms, .gap = 10ms, .ceiling = 300ms, .drain = 30ms, .character = 1ms};

class LineTest : public ::testing::Test, protected LineClient {
 protected:
  class Tested {
   public:
    explicit Tested(LineTest& test) : test_(test), line_(test) {}
    void OnOpened(Instant now, bool keeps = false) { line_.OnOpened(now, keeps); }
    void OnClosed() { test_.Keep(line_.OnClosed()); }
    void Feed(View bytes, Instant now) { test_.Keep(line_.Feed(bytes, now)); }
    void OnCollision(Instant now) { test_.Keep(line_.OnCollision(now)); }
    void OnEnded(Instant now) { test_.Keep(line_.OnEnded(now)); }
    void OnTimer(Instant now) { test_.Keep(line_.OnTimer(now)); }
    void Start(Exchange exchange, Instant now) {
      test_.request_ = std::string(AsText(exchange.request.bytes));
      test_.Keep(line_.Start(std::move(exchange), now));
    }
    bool idle() const { return line_.idle(); }
    State state() const { return line_.state(); }
    std::optional<Instant> Deadline() const { return line_.Deadline(); }

   private:
    LineTest& test_;
    Line line_;
  };

  void Keep(const LineNews& news) {
    if (news.send) sent_.push_back(request_);
    if (news.stray_before.count > 0) strays_.push_back(news.stray_before);
    before_ += news.stray_before.count;
    if (news.end) ends_.push_back(*news.end);
    if (news.stray.count > 0) strays_.push_back(news.stray);
    if (news.stray.second_reply || news.stray_before.second_reply) ++second_;
  }
  Outcome Judge(View frame, Instant) override {
    frames_.emplace_back(AsText(frame));
    EXPECT_FALSE(line_.idle()) << "a client could start the next exchange inside the last";
    return verdict_;
  }

  Instant At(Duration offset) const { return kStart + offset; }
  void Opened() { line_.OnOpened(At(0ms)); }
  void Start(Duration at, std::string_view request = "?A1\r") {
    Exchange exchange;
    exchange.request.bytes = ToBytes(request);
    exchange.request.expect = ToyProtocol().expect(exchange.request.bytes, {});
    exchange.reply_rule = rule_;
    exchange.times = kTimes;
    exchange.lags = lags_;
    exchange.aftermath = aftermath_;
    if (!named_) exchange.request.expect.address.clear();
    exchange.request.expect.mirrors = mirrors_;
    exchange.request.any_order = any_order_;
    exchange.request.numbered = numbered_;
    line_.Start(std::move(exchange), At(at));
  }
  void Reach(State state) {
    if (state == State::closed) return;
    Opened();
    if (state == State::idle) return;
    if (state == State::quiet) {
      line_.Feed(ToBytes("x"), At(999ms));
      strays_.clear();
      return Start(1s);
    }
    Start(1s, state == State::settle ? "QA1\r" : "?A1\r");
    if (state == State::sending) return;
    line_.OnTimer(At(1004ms));
    if (state == State::receiving) line_.Feed(ToBytes("!A"), At(1010ms));
    if (state == State::drain) line_.OnTimer(At(1104ms));
    ends_.clear();
  }
  Duration DeadlineIn() const { return *line_.Deadline() - kStart; }

  Tested line_{*this};
  Outcome verdict_ = Outcome::ok;
  protocols::FrameRule rule_ = ToyProtocol().reply_rule;
  bool lags_ = false;
  bool named_ = true;
  bool mirrors_ = false;
  bool any_order_ = false;
  bool numbered_ = false;
  Duration aftermath_{};
  std::string request_;
  std::vector<std::string> sent_;
  std::vector<std::string> frames_;
  std::vector<ExchangeEnd> ends_;
  std::vector<StrayBytes> strays_;
  std::size_t before_ = 0;  // bytes in `strays_` that arrived before the end of the exchange
  int second_ = 0;
  const Bytes reply_ = ToyReply("A1=5");
};

}  // namespace baudgate::bus
