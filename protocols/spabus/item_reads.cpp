// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/item_reads.h"

#include <algorithm>

#include "gateway/base/shown.h"
#include "protocols/spabus/nack.h"

namespace baudgate::protocols::spabus {
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
