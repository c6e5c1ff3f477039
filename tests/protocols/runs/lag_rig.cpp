// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/lag_rig.h"

#include <utility>

namespace baudgate::protocols {
namespace {

config::Line Changed(config::Line line, const std::function<void(config::Line&)>& change) {
  if (change) change(line);
  return line;
}

}  // namespace

LagRig::LagRig(const LagCase& which, unsigned seed,
               const std::function<void(config::Line&)>& change)
    : LagStage(which, seed, Changed(LagLineOf(which), change)),
      line_(std::make_unique<VirtualLine>(line_config(), std::vector{which.setup.protocol},
                                          strangers())) {
  line_->keep_sent = false;
  for (std::size_t twin = 0; twin < twins(); ++twin) {
    line_->twin(twin).values.instead = &ValuesOf(twin);
    line_->twin(twin).manner.dead = !IsThere(twin);
    line_->twin(twin).manner.instead = [this, twin](View request) {
      return Instead(twin, request);
    };
  }
  Judge(line_->store());
  line_->server = [this](View request, Bytes reply, Instant end) {
    return server().OnRequest(request, std::move(reply), end);
  };
  line_->always = [this] { oracle().Look(); };
}

void LagRig::Open() {
  line_->Open();
  EXPECT_TRUE(line_->RunUntil([this] { return AllGood(); }, 2min))
      << which().name() << ": not every point became good";
}

void LagRig::RunFor(Duration time) {
  const Instant until = NowOnStage() + time;
  while (true) {
    const auto next = NextChange();
    if (!next || *next > until) break;
    if (*next > NowOnStage()) line_->RunFor(*next - NowOnStage());
    Change();
    for (std::size_t twin = 0; twin < twins(); ++twin)
      line_->twin(twin).manner.dead = !IsThere(twin);
  }
  if (until > NowOnStage()) line_->RunFor(until - NowOnStage());
}

}  // namespace baudgate::protocols
