// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/probe_choice.h"

#include <algorithm>
#include <utility>

namespace baudgate {
namespace {

constexpr int kSilencesOfAnUnknownRequest = 3;

}  // namespace

bool ProbeChoice::GivenUp() const {
  return own_ == Own::none || (!own_answered_ && silences_ >= kSilencesOfAnUnknownRequest);
}

std::optional<std::size_t> ProbeChoice::Next(std::size_t reads, std::size_t best) const {
  if (reads == 0 || (own_ == Own::read && own_answered_)) return std::nullopt;
  if (failed_ % 2 == 1) return (failed_ + 1) / 2 % reads;
  return GivenUp() ? std::optional(best) : std::nullopt;
}

void ProbeChoice::OnAnswered(bool own) {
  // The answer to a read may belong to an earlier request. A device that answers its own probe is
  // asked that next.
  failed_ = own || !own_answered_ ? 0 : failed_ + 1;
  if (own) {
    silences_ = 0;
    own_unanswered_ = false;
    own_answered_ = true;
  } else if (std::exchange(own_unanswered_, false)) {
    ++silences_;
  }
}

bool ProbeChoice::OnFailed(bool own) {
  ++failed_;
  if (own) own_unanswered_ = true;
  return own && !own_answered_ && failed_ == 1;
}

void ProbeChoice::OnReconnect() {
  own_unanswered_ = false;
  silences_ = std::min(silences_, kSilencesOfAnUnknownRequest - 1);
}

}  // namespace baudgate
