// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/background.h"

#include <algorithm>

#include "gateway/base/deadline.h"

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
  items_[device].again = {};
  items_[device].turn = ++turn_;
}

void Background::SetProof(std::size_t device, Instant may, Instant must) {
  Item& item = At(device);
  item.may_prove = may;
  item.must_prove = must;
}

void Background::Longest::Learn(Duration its) {
  constexpr int kFades = 64;
  took = std::max(its, took - (took - its) / kFades);
  ++known;
}

void Background::OnEnd(std::size_t device, Duration took, bool proved) {
  Item& item = At(device);
  item.lost = took == Duration::zero();
  if (!item.lost) (proved ? item.proved : item.plain).Learn(took);
}

std::optional<Instant> Background::MayBegin(std::size_t device) const {
  const Item& item = items_[device];
  if (!item.due || item.awaits_disk || schedule_.suspended(device)) return std::nullopt;
  return std::max({*item.due, item.again, schedule_.held_until(device)});
}

Instant Background::Starves(const Item& item) const {
  return std::max(*item.due, item.taken) + kLongest;
}

/// The next exchange may be longer than all so far; few say little.
Duration Background::RoomOf(const Item& item) {
  if (item.lost || item.plain.known < kFew) return item.room;
  return std::clamp<Duration>(item.plain.took * 3 / 2, item.room / 2, item.room);
}

Duration Background::RoomToProve(const Item& item) {
  return item.proved.known == 0 ? 2 * item.room : item.proved.took * 3 / 2;
}

bool Background::IsIdleFor(Duration room, Instant at) const {
  const auto poll = schedule_.NextDue();
  return !poll || *poll - at >= room;
}

bool Background::Fits(const Item& item, Instant at) const {
  return IsIdleFor(at >= item.must_prove ? RoomToProve(item) : RoomOf(item), at);
}

bool Background::HasRoom(std::size_t device, Instant now) const {
  return device < items_.size() && IsIdleFor(RoomOf(items_[device]), now);
}

bool Background::MayProve(std::size_t device, Instant now) const {
  const Item& item = items_[device];
  return now >= item.may_prove && IsIdleFor(RoomToProve(item), now);
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
    soonest = Soonest({soonest, when});
  }
  return soonest;
}

}  // namespace baudgate
