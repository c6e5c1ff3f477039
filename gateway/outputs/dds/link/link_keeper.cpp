// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_keeper.h"

#include <algorithm>
#include <array>
#include <utility>

namespace baudgate::dds {
namespace {

constexpr std::array<Duration, 6> kLadder{100ms, 500ms, 1s, 2s, 5s, 10s};
constexpr Duration kLongLife = 1min;

}  // namespace

LinkKeeper::Wish LinkKeeper::Look(Instant now) {
  using Phase = LinkState::Phase;
  if (state_.phase == Phase::waiting) {
    const bool due = first_ || (state_.next_start && now >= *state_.next_start);
    return starts_ && due ? Wish::start : Wish::nothing;
  }
  if (now - state_.heard >= patience()) return Wish::give_up;
  if (now - state_.heard >= kSilent) state_.phase = Phase::silent;
  return Wish::nothing;
}

Instant LinkKeeper::NextLook() const {
  using Phase = LinkState::Phase;
  if (state_.phase == Phase::silent) return state_.heard + patience();
  if (state_.phase != Phase::waiting) return state_.heard + kSilent;
  if (!starts_) return Instant::max();
  return first_ ? Instant() : state_.next_start.value_or(Instant::max());
}

void LinkKeeper::Started(Instant now) {
  first_ = state_.opened = false;
  started_ = now;
  state_.phase = LinkState::Phase::starting;
  state_.heard = now;
  state_.next_start.reset();
}

void LinkKeeper::Opened(Instant now) {
  state_.opened = true;
  state_.phase = LinkState::Phase::up;
  state_.heard = now;
}

void LinkKeeper::Counted(const LinkCounts& counts, Instant now) {
  state_.heard = now;
  state_.phase = state_.opened ? LinkState::Phase::up : LinkState::Phase::starting;
  state_.subscribers = counts.subscribers;
  state_.written = before_.written + counts.written;
  state_.refused = before_.refused + counts.refused;
  state_.requests_dropped = before_.dropped + counts.dropped;
  state_.events_skipped = before_.events_dropped + counts.events_dropped;
  state_.datagrams = counts.datagrams;
  state_.datagrams.AddEarlier(before_.datagrams);
  state_.remarks = counts.neighbours.remarks;
  reached_ = counts.neighbours.reached;
  if (now - started_ >= kYoung) return;
  for (const config::HostPort& at : before_.neighbours.reached) {
    if (reached_.size() == Neighbours::kMostReached) break;
    if (std::ranges::find(reached_, at) == reached_.end()) reached_.push_back(at);
  }
}

void LinkKeeper::Ended(std::string reason, Instant now) {
  first_ = false;
  if (state_.opened) ++state_.times_lost;
  if (state_.opened && now - started_ >= kLongLife) rung_ = 0;
  if (starts_) state_.next_start = now + kLadder[rung_];
  rung_ = std::min(rung_ + 1, kLadder.size() - 1);
  state_.opened = false;
  state_.phase = LinkState::Phase::waiting;
  state_.reason = std::move(reason);
  state_.subscribers = {};
  state_.datagrams.participants = 0;
  state_.remarks.clear();
  before_ = {.subscribers = {},
             .written = state_.written,
             .refused = state_.refused,
             .dropped = state_.requests_dropped,
             .events_dropped = state_.events_skipped,
             .datagrams = state_.datagrams,
             .neighbours = {.reached = reached_, .remarks = {}}};
}

}  // namespace baudgate::dds
