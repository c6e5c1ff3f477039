// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/conversation.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/expect.h"
#include "protocols/reader/frame_rule.h"

namespace baudgate::protocols::reader {
namespace {

constexpr std::uint32_t kTagCode = 1;   // of the events, see config/profiles/reader
constexpr std::size_t kMostKnown = 64;  // texts that a repeat is recognised of

std::vector<Item> ItemsOf(const config::Device& device) {
  std::vector<Item> items;
  for (const config::Point& point : device.points) items.push_back(ParseItem(point).value());
  return items;
}

Standing StandingOf(const config::Device& device, const Settings& settings) {
  return {.rule = MessageRule,
          .expect = Expect({}, device.options),
          .idle = settings.idle,
          .whole = settings.whole,
          .marked = settings.form == Form::tag || settings.start};
}

bool IsNoTag(const std::string& text, const Settings& settings) {
  return settings.form == Form::tag && text.find_first_not_of('0') == std::string::npos;
}

}  // namespace

ReaderConversation::ReaderConversation(const config::Device& device)
    : device_(device),
      settings_(ReadSettings(device.options)),
      items_(ItemsOf(device)),
      standing_(StandingOf(device, settings_)),
      had_number_(items_.size()) {}

Result<Request> ReaderConversation::Ask(const Task&, Instant) {
  return Error{"a reader is not asked: it speaks by itself"};
}

Answer ReaderConversation::OnFrame(const Task&, const Request& request, View frame, Instant) {
  return Interpret(request.bytes, frame);
}

Outcome ReaderConversation::Check(View, View frame) const {
  return Decode(frame, settings_) ? Outcome::ok : Outcome::corrupt;
}

Answer ReaderConversation::Interpret(View, View frame) {
  const auto text = Decode(frame, settings_);
  if (!text) return {Outcome::corrupt, text.error()};
  Answer answer;
  const bool none = IsNoTag(*text, settings_);
  answer.readings.push_back({.value = none ? "no tag" : *text, .label = "tag"});
  return answer;
}

Answer ReaderConversation::OnUnasked(View message, Now received) {
  const auto text = Decode(message, settings_);
  if (!text) return {Outcome::corrupt, text.error()};
  Answer answer;
  const bool none = text->empty() || IsNoTag(*text, settings_);
  for (std::size_t point = 0; point < items_.size(); ++point) {
    const Item& item = items_[point];
    if (item.kind == Item::Kind::message)
      answer.readings.push_back({.point = point, .value = *text});
    if (item.kind != Item::Kind::number) continue;
    const Decoded number = NumberIn(item, *text);
    if (!IsGood(number.quality) && !had_number_[point]) continue;
    had_number_[point] = true;
    answer.readings.push_back({.point = point, .value = number.value, .quality = number.quality});
  }
  gone_at_.reset();
  if (!none && settings_.present > Duration::zero())
    gone_at_ = received.instant + settings_.present;
  Tell(Item::Kind::present, {!none}, answer);
  if (!none && IsRepeat(*text, received.instant)) {
    ++repeats_;
  } else if (!none) {
    AddTag(*text, received, answer);
  }
  Tell(Item::Kind::repeats, {static_cast<std::int64_t>(repeats_)}, answer);
  return answer;
}

Answer ReaderConversation::OnDue(Now now) {
  Answer answer;
  if (!gone_at_ || *gone_at_ > now.instant) return answer;
  gone_at_.reset();
  Tell(Item::Kind::present, {false}, answer);
  return answer;
}

/// What was there meanwhile nobody knows.
void ReaderConversation::OnReconnect() { latest_.clear(); }

void ReaderConversation::OnEventsKept(std::string_view said) {
  if (std::exchange(recalled_, true)) return;
  // Some may have come before it was known how many there were.
  const auto before = ParseInteger<std::uint64_t>(said).value_or(0);
  counter_ += before;
  for (auto& tag : ring_) tag.counter += before;
}

/// Within `same_tag` of the last time that it came: a tag that stays is one.
bool ReaderConversation::IsRepeat(const std::string& text, Instant now) {
  if (settings_.same_tag <= Duration::zero()) return false;
  std::erase_if(latest_, [&](const auto& one) { return now - one.second >= settings_.same_tag; });
  if (latest_.size() >= kMostKnown && !latest_.contains(text)) {
    latest_.erase(
        std::ranges::min_element(latest_, {}, [](const auto& one) { return one.second; }));
  }
  return !latest_.insert_or_assign(text, now).second;
}

void ReaderConversation::AddTag(const std::string& text, Now received, Answer& answer) {
  ring_.push_front({text, ++counter_, received.wall});
  if (ring_.size() > kRing) ring_.pop_back();
  TellRing(answer);
  if (!device_.events) return;
  answer.batch =
      EventBatch{.events = {{.code = kTagCode, .text = text}}, .said = std::to_string(counter_)};
}

/// Places for which there was no tag yet have no value: a 0 would be one.
void ReaderConversation::TellRing(Answer& answer) const {
  for (std::size_t point = 0; point < items_.size(); ++point) {
    const Item& item = items_[point];
    if (!item.of_tag()) continue;
    Decoded decoded{{}, {Quality::bad_sensor_failure, Reason::not_ready}};
    if (item.back < ring_.size()) decoded = ValueOf(item, ring_[item.back]);
    answer.readings.push_back({.point = point, .value = decoded.value, .quality = decoded.quality});
  }
}

void ReaderConversation::Tell(Item::Kind kind, const Decoded& decoded, Answer& answer) const {
  for (std::size_t point = 0; point < items_.size(); ++point) {
    if (items_[point].kind != kind) continue;
    answer.readings.push_back({.point = point, .value = decoded.value, .quality = decoded.quality});
  }
}

}  // namespace baudgate::protocols::reader
