// `LagSoakLine` is a real line on a pty behind a lagging server. The values of its simulated
// devices contain the device and the time of measurement (tests/protocols/runs/lag_stage.h). Quiet
// and troubled turns alternate.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "gateway/lines/line_runner.h"
#include "tests/protocols/runs/lag_stage.h"
#include "tests/soak/lag_port.h"
#include "transports/loop_thread.h"

namespace baudgate {

class LagSoakLine final : public protocols::LagStage {
 public:
  /// The simulated devices run on `world`, in the thread that calls these functions. The line runs
  /// in a thread of its own.
  LagSoakLine(const protocols::LagCase& which, unsigned seed, const std::string& path,
              asio::io_context& world);
  ~LagSoakLine() override { runner_->Stop(); }

  void BeginTroubles(Duration turn);
  void EndTroubles();
  bool IsReplacing() const;
  /// Checks the store, and changes devices and faults when their time has come; must be called as
  /// often as possible. A wrong reading fails the test.
  void Look();
  void PrintSummary();

 private:
  /// Sums over the points and the turns that have ended, in seconds: good time, and all time.
  struct Share {
    double good = 0;
    double all = 0;
    std::string Text() const;
  };

  Instant NowOnStage() const override;
  bool Submit(bus::WriteCommand command) override;
  std::vector<tools::TimedPiece> OnRequest(View request, Instant end);
  void MakeTwins();
  void EndTurn();
  void NextTurn();
  void DoSomething();
  std::size_t OneOf(std::size_t count) { return random_() % count; }

  const unsigned seed_;
  std::mt19937 random_;
  asio::io_context& world_;
  config::Config config_;
  bus::PointStore store_;
  std::vector<std::unique_ptr<protocols::Twin>> twins_;
  LagPort port_;
  transports::LoopThread loop_{"line"};
  std::unique_ptr<lines::LineRunner> runner_;

  Duration turn_{};
  Instant turn_began_{};
  Instant turn_ends_ = Instant::max();
  Instant next_deed_ = Instant::max();
  Instant next_replacement_{};
  bool troubled_ = false;
  std::string trouble_ = "quiet";
  Share quiet_share_;
  Share troubled_share_;
  bool told_ = false;
};

}  // namespace baudgate
