// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/plan.h"

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {

namespace {

bool AreNeighbours(std::uint32_t a, std::uint32_t b) { return a + 1 == b || b + 1 == a; }

/// Whether its neighbours stand in other channels: 1I1, 2I1, 3I1. Neighbours of its own channel go
/// before, and channel 0 is no channel among others: it holds what is common to all.
bool IsAcross(const ReadPoint& point, std::span<const ReadPoint> points) {
  const Address& own = point.address;
  if (!own.number || own.channel == 0) return false;
  const auto shares = [&](const ReadPoint& other) {
    return other.address.category == own.category && other.address.number &&
           other.point->group == point.point->group;
  };
  const bool in_channel = std::ranges::any_of(points, [&](const ReadPoint& other) {
    return shares(other) && other.address.channel == own.channel &&
           AreNeighbours(*other.address.number, *own.number);
  });
  return !in_channel && std::ranges::any_of(points, [&](const ReadPoint& other) {
    return shares(other) && other.address.number == own.number && other.address.channel != 0 &&
           AreNeighbours(other.address.channel, own.channel);
  });
}

}  // namespace

ItemPlan MakePlan(std::span<const ReadPoint> points, const RequestLimits& limits, Often is_often) {
  ItemPlan plan({.may_join =
                     [&limits](const Block<Row>& block, const Block<Row>& next) {
                       return next.begin == block.end && block.size() < limits.items &&
                              (limits.channels || !block.key.across);
                     },
                 .refused = WhenRefused::ask_daily,
                 .refusals = 3,
                 .is_often = std::move(is_often)});
  for (const ReadPoint& point : points) {
    const Address& address = point.address;
    const std::uint32_t number = address.number.value_or(0);
    const bool across = IsAcross(point, points);
    const std::size_t place = across ? address.channel : number;
    plan.Add(point.point->group, point.index,
             {address.category, across, across ? number : address.channel}, place, place + 1);
  }
  plan.Make();
  return plan;
}

Command ReadOf(unsigned slave, const Block<Row>& block) {
  const auto [category, across, common] = block.key;
  const Range places{static_cast<std::uint32_t>(block.begin),
                     static_cast<std::uint32_t>(block.end - 1)};
  const Range same{common, common};
  Command command;
  command.slave = slave;
  command.category = category;
  command.channels = across ? places : same;
  if (TakesNumber(category)) command.numbers = across ? same : places;
  return command;
}

namespace {

constexpr int kFailuresOfChannels = 2;
constexpr int kInputOverflow = 2;

}  // namespace

ItemReads::ItemReads(const config::Device& device, const Settings& settings)
    : settings_(settings),
      points_(ReadablePoints(device.points)),
      limits_(ConfiguredLimits()),
      plan_(MakePlan(points_, limits_, OftenOf(device))) {}

bool ItemReads::IsChannelRange(std::size_t query) const {
  return plan_.block(query).key.across && plan_.block(query).size() > 1;
}

bool ItemReads::OnAnswered(std::size_t query, Instant now) {
  if (IsChannelRange(query)) channels_work_ = true;
  const bool changed = plan_.OnAnswered(query, now) != PlanChange::nothing;
  if (!larger_.TakeDue(now)) return changed;
  limits_.items = settings_.max_items;
  limits_.channels = true;
  plan_.Make();
  return true;
}

/// What is asked changes so that one item does not cost the others.
bool ItemReads::TakeRefusal(std::size_t query, int nack, Answer& answer, Instant now) {
  // "Does not have it" takes three: a damaged reply may look like a refusal.
  if (!plan_.IsLastRefusal(query)) answer.readings.clear();
  const NackRule& rule = RuleOf(nack);
  const std::size_t items = plan_.block(query).size();
  if (items > 1 && nack == kInputOverflow)
    answer.remedy = "set a lower max_items in the configuration";
  const bool unknown = nack == kTooComplicated || nack == kSyntax;
  if (unknown && IsChannelRange(query) && !channels_work_) {
    larger_.OnRefused(now);
    return ForgoChannels();
  }
  if (items > 1 && (nack == kTooComplicated || nack == kInputOverflow)) {
    limits_.items = std::min(limits_.items, items / 2);
    larger_.OnRefused(now);
    plan_.Make();
    return true;
  }
  if (items == 1 ? !rule.missing : !rule.worth_splitting) {
    return plan_.OnHeard(query, now) != PlanChange::nothing;
  }
  return plan_.OnRefused(query, now) != PlanChange::nothing;
}

/// A range of channels that has never been answered may be what the device does not understand:
/// some say nothing then, or give one value. One that is silent to several items of a channel, and
/// answers other requests, is asked for fewer.
bool ItemReads::OnFailure(std::size_t query, Outcome outcome, Instant now) {
  const bool silent = outcome == Outcome::no_reply;
  if (!silent && outcome != Outcome::unexpected) return false;
  if (query >= plan_.queries().size() || plan_.block(query).size() < 2) return false;
  if (!channels_work_ && IsChannelRange(query)) {
    return ++channel_failures_ >= kFailuresOfChannels && ForgoChannels();
  }
  return silent && plan_.OnSilent(query, now) != PlanChange::nothing;
}

bool ItemReads::ForgoChannels() {
  limits_.channels = false;
  plan_.Make();
  return true;
}

void ItemReads::OnReconnect() {
  limits_ = ConfiguredLimits();
  larger_.Forget();
  channels_work_ = false;
  channel_failures_ = 0;
  plan_.OnReconnect();
}

std::string ItemReads::Learned() const {
  std::string text;
  const auto say = [&text](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  if (limits_.items < settings_.max_items) {
    say("at most " + Plural(limits_.items, "item") + " in one request");
  }
  if (!limits_.channels) say("one channel in one request");
  if (limits_.written < settings_.write_items) say("one value in one write");
  if (channels_work_) say("several channels in one request");
  return text;
}

}  // namespace baudgate::protocols::spabus
