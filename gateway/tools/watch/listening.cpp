// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/listening.h"

#include <utility>

namespace baudgate {
namespace {

constexpr Duration kLookInterval = 1s;

}  // namespace

Listening::Listening(std::vector<std::string> interfaces, Open open, Find find)
    : interfaces_(std::move(interfaces)), open_(std::move(open)), find_(std::move(find)) {}

Status Listening::Start() {
  watched_.emplace(interfaces_, find_());
  return open_();
}

std::optional<std::string> Listening::Look(Instant now) {
  if (now < next_look_) return std::nullopt;
  next_look_ = now + kLookInterval;
  std::string told;
  if (!failure_) {
    const auto changed = watched_->Look(find_());
    if (!changed) return std::nullopt;
    told = *changed + "; ";
  }
  const Status status = Start();
  const auto before = std::exchange(failure_, std::nullopt);
  if (status) return told + "begun anew";
  failure_ = status.error();
  if (before == failure_) return std::nullopt;
  return told + *failure_;
}

}  // namespace baudgate
