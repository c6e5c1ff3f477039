// LagRig is a line behind a lagging server in virtual time, with an oracle
// (tests/protocols/runs/lag_stage.h).
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
  LagRig(const LagCase& which, unsigned seed,
         const std::function<void(config::Line&)>& change = {});

  void Open();
  VirtualLine* operator->() { return line_.get(); }
  VirtualLine& line() { return *line_; }
  void RunFor(Duration time);

 private:
  Instant NowOnStage() const override { return line_->now().instant; }
  bool Submit(bus::WriteCommand command) override { return line_->Submit(std::move(command)); }

  std::unique_ptr<VirtualLine> line_;
};

}  // namespace baudgate::protocols
