// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/background.h"

#include <algorithm>

namespace baudgate {

Background::Item& Background::At(std::size_t device) {
  if (items_.size() <= device) items_.resize(device + 1);
  return items_[device];
}

void Background::Set(std::size_t device, std::optional<Instant> due, Duration room) {
  Item& item = At(device);
  item.due = due;
  item.room = room;
}

void Background::OnTaken(std::size_t device, Instant now) {
  items_[device].taken = now;
  items_[device].turn = ++turn_;
}

void Background::OnEnd(std::size_t device, Duration took) {
  constexpr int kFades = 64;
  Item& item = At(device);
  const bool known = took != Duration::zero();
  item.took = known ? std::max(took, item.took - (item.took - took) / kFades) : took;
}

std::optional<Instant> Background::MayBegin(std::size_t device) const {
  const Item& item = items_[device];
  if (!item.due || item.held || schedule_.suspended(device)) return std::nullopt;
  return std::max(*item.due, schedule_.held_until(device));
}

Instant Background::Starves(const Item& item) const {
  return std::max(*item.due, item.taken) + kLongest;
}

bool Background::Fits(const Item& item, Instant at) const {
  const auto poll = schedule_.NextDue();
  const bool known = item.took != Duration::zero();
  // The next exchange may be longer than all so far.
  const Duration room =
      known ? std::clamp<Duration>(item.took * 3 / 2, item.room / 2, item.room) : item.room;
  return !poll || *poll - at >= room;
}

std::optional<std::size_t> Background::Next(Which which, Instant now) const {
  std::optional<std::size_t> best;
  for (std::size_t device = 0; device < items_.size(); ++device) {
    const Item& item = items_[device];
    const auto begin = MayBegin(device);
    if (!begin || *begin > now) continue;
    if (which == Which::that_starves ? Starves(item) > now : !Fits(item, now)) continue;
    if (!best || item.turn < items_[*best].turn) best = device;
  }
  return best;
}

std::optional<Instant> Background::NextAt(Instant now) const {
  std::optional<Instant> soonest;
  for (std::size_t device = 0; device < items_.size(); ++device) {
    const auto begin = MayBegin(device);
    if (!begin) continue;
    const Instant at = std::max(*begin, now);
    const Instant when = Fits(items_[device], at) ? at : std::max(at, Starves(items_[device]));
    if (!soonest || when < *soonest) soonest = when;
  }
  return soonest;
}

}  // namespace baudgate
