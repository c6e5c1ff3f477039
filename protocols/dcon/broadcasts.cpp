// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/broadcasts.h"

#include <utility>

namespace baudgate::protocols::dcon {

bool Sampling::WantsNew(Instant now) const {
  return asked_ == group_.samples || !group_.sampled_at || now - *group_.sampled_at > period_;
}

void Sampling::OnSampled(Instant now) {
  ++group_.samples;
  group_.sampled_at = now;
}

std::optional<std::string> Sampling::WhyNot(bool first) {
  const auto before = std::exchange(fetched_, asked_);
  const bool overtaken = before && asked_ - *before > 1;
  overtaken_ = overtaken ? overtaken_ + 1 : 0;
  if (!first) return "the module has not heard the last #**: its sample is an older one";
  if (!before) return "the module's sample may be an older one: the next one counts";
  if (overtaken)
    return "several samples are under way, and it is not known which one the module has sent";
  return std::nullopt;
}

}  // namespace baudgate::protocols::dcon
