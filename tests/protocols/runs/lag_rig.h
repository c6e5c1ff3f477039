// LagRig is a line of real devices behind a lagging server in virtual time, and an oracle that
// judges the store (lag_stage.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "tests/protocols/runs/lag_stage.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {

class LagRig final : public LagStage {
 public:
  /// `change` may modify the line before it is built.
  LagRig(const LagCase& which, unsigned seed,
         const std::function<void(config::Line&)>& change = {});

  /// Opens the line and runs it until every point is good.
  void Open();
  VirtualLine* operator->() { return line_.get(); }
  VirtualLine& line() { return *line_; }
  /// Runs for this time, including changes that become due, for example a stranger that is switched
  /// on.
  void RunFor(Duration time);

 private:
  Instant NowOnStage() const override { return line_->now().instant; }
  bool Submit(bus::WriteCommand command) override { return line_->Submit(std::move(command)); }

  std::unique_ptr<VirtualLine> line_;
};

}  // namespace baudgate::protocols
