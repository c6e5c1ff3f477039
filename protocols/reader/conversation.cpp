// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/conversation.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <tuple>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/rules.h"

namespace baudgate::protocols::reader {
namespace {

// DeviceEvent::code of tag events, also used in config/profiles/reader.
constexpr std::uint32_t kTagCode = 1;
constexpr std::size_t kMostKnown = 64;  // latest_ contains at most this many texts
constexpr std::size_t kMostOwed = 16;   // the maximum number of outstanding replies to `r`
constexpr std::size_t kMostQuoted = 30;

std::vector<Item> ItemsOf(const config::Device& device) {
  std::vector<Item> items;
  for (const config::Point& point : device.points) items.push_back(ParseItem(point).value());
  return items;
}

/// Returns at most two queries: the reader's identity, and the points of a message.
std::vector<Query> QueriesOf(const config::Device& device, const std::vector<Item>& items,
                             const Settings& settings) {
  std::vector<Query> queries;
  if (!settings.asks) return queries;
  Query identity{config::Group::once};
  Query tag{config::Group::once};
  for (std::size_t point = 0; point < items.size(); ++point) {
    if (items[point].kind == Item::Kind::identity) identity.points.push_back(point);
    if (!items[point].of_message()) continue;
    tag.points.push_back(point);
    tag.group = std::max(tag.group, device.points[point].group);
  }
  for (Query* query : {&identity, &tag}) {
    if (!query->points.empty()) queries.push_back(std::move(*query));
  }
  return queries;
}

Standing StandingOf(const Settings& settings) {
  return {.rule = MessageRule,
          .expect = Expect({}, settings),
          .idle = settings.idle,
          .whole = settings.whole,
          .marked = settings.form == Form::tag || settings.start};
}

bool IsNoTag(const std::string& text, const Settings& settings) {
  return settings.form == Form::tag && text.find_first_not_of('0') == std::string::npos;
}

bool HasDecimalComma(std::string_view text) {
  for (std::size_t at = text.find(','); at != std::string_view::npos; at = text.find(',', at + 1)) {
    if (IsDecimalComma(text, at)) return true;
  }
  return false;
}

/// True for sentences of NMEA 0183, such as "$GPGGA,063905.00,", which satellite receivers,
/// compasses and wind sensors send.
bool IsSentence(std::string_view text) {
  constexpr std::size_t kName = 5;
  if (text.size() < kName + 2 || (text[0] != '$' && text[0] != '!') || text[kName + 1] != ',') {
    return false;
  }
  return std::ranges::all_of(text.substr(1, kName), [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  });
}

/// True if a scale reports an overload, as in "OL,GS,+-------kg" or "OVER".
bool ShowsOverload(std::string_view text) {
  return text.starts_with("OL") || text.find("OVER") != std::string_view::npos ||
         text.find("over") != std::string_view::npos;
}

bool HasErrorWord(std::string_view text) {
  std::string low(text);
  std::ranges::transform(low, low.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::any_of(std::initializer_list<const char*>{"err", "fault", "fail"},
                             [&](const char* word) { return low.find(word) != std::string::npos; });
}

/// Returns the reason why `text` has no usable number, and the remedy.
std::pair<std::string, std::string> WhyNoNumber(std::string_view text, std::string_view unit) {
  constexpr std::string_view kNumber = "0123456789.";
  constexpr std::string_view kDigit = "0123456789";
  const std::string quoted = "'" + std::string(text.substr(0, kMostQuoted)) + "'";
  if (IsSentence(text)) {
    return {"sentences of NMEA 0183 come (" + quoted + ")",
            "another device, such as a GPS receiver, is at this port; check the port and the plug"};
  }
  const auto its = UnitBehind(text, unit);
  if (its && !IsSameUnit(*its, unit)) {
    return {"the unit in " + quoted + " is not " + std::string(unit),
            "set the indicator to " + std::string(unit) + ", or correct the unit of the point"};
  }
  int numbers = 0;
  bool sign_behind = false;
  for (std::size_t at = text.find_first_of(kDigit); at != std::string_view::npos;
       at = text.find_first_of(kDigit, at)) {
    ++numbers;
    at = std::min(text.find_first_not_of(kNumber, at), text.size());
    sign_behind = sign_behind || (at < text.size() && text[at] == '-');
  }
  if (sign_behind && numbers == 1) {
    return {"the sign comes after the number in " + quoted,
            "set the indicator to send the sign in front of the number"};
  }
  if (numbers == 2 && HasDecimalComma(text)) {
    return {"the number in " + quoted + " has a decimal comma",
            "set the indicator to a decimal point"};
  }
  if (numbers > 1) {
    return {"there are " + std::to_string(numbers) + " numbers in " + quoted,
            "set the key read of the point to the characters of one number: number FROM-TO"};
  }
  if (numbers == 0 && ShowsOverload(text)) {
    return {"the indicator shows overload in " + quoted, "remove the load, or check the load cell"};
  }
  if (HasErrorWord(text)) {
    return {
        "the indicator sends " + quoted + " instead of a number",
        "the indicator has a fault; look the text up in its manual (load cell, overload, cable)"};
  }
  if (numbers == 1 && IsMass(unit) && !its) {
    return {"no unit follows the number in " + quoted,
            "if the number is the weight, set the key read of the point to its characters: number "
            "FROM-TO"};
  }
  return {"there is no number in " + quoted,
          "check the indicator for overload, and whether read: number fits its messages"};
}

}  // namespace

ReaderConversation::ReaderConversation(const config::Device& device, const Settings& settings)
    : device_(device),
      settings_(settings),
      items_(ItemsOf(device)),
      queries_(QueriesOf(device, items_, settings_)),
      standing_(StandingOf(settings_)),
      had_number_(items_.size()) {}

Result<Request> ReaderConversation::Ask(const Task& task, Instant) {
  const bool polls = task.kind == Task::Kind::poll;
  if (!settings_.asks || (!polls && task.kind != Task::Kind::probe)) {
    return Error{"a reader cannot be polled; it sends by itself"};
  }
  const std::size_t point = polls ? queries_[task.query].points.front() : 0;
  const bool information = polls && items_[point].kind == Item::Kind::identity;
  Request request;
  request.bytes = EncodeCommand(information ? Command::information : Command::read);
  request.expect = Expect(request.bytes, settings_);
  // All replies to `r` show the present tag, and all replies to `i` are equal, so a late reply is
  // as good as a new one.
  request.any_order = true;
  request.stamped = true;
  request.reply = settings_.answer;
  return request;
}

void ReaderConversation::Stamp(Request& request, Now arrives, Duration) {
  if (!IsInformation(request.bytes)) owed_.push_back(arrives.instant + 2 * settings_.answer);
  if (owed_.size() > kMostOwed) owed_.pop_front();
}

/// Takes the reply to the information command. A reply to `r` gives no readings here, because it
/// also comes to OnUnasked as a message.
Answer ReaderConversation::OnFrame(const Task&, const Request& request, View frame, Instant) {
  if (!IsInformation(request.bytes)) return {};
  const auto said = DecodeInformation(frame);
  if (!said) return {Outcome::corrupt, said.error()};
  Answer answer;
  Tell(Item::Kind::identity, {*said}, answer);
  return answer;
}

Outcome ReaderConversation::Check(View request, View frame) const {
  const auto said = IsInformation(request) ? DecodeInformation(frame) : Decode(frame, settings_);
  return said ? Outcome::ok : Outcome::corrupt;
}

Answer ReaderConversation::Interpret(View request, View frame) {
  if (IsInformation(request)) {
    const auto said = DecodeInformation(frame);
    if (!said) return {Outcome::corrupt, said.error()};
    return {.readings = {{.value = *said, .label = "identity"}}};
  }
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
    const std::string& unit = device_.points[point].unit;
    const Decoded number = NumberIn(item, *text, unit);
    if (!IsGood(number.quality)) {
      std::tie(answer.reason, answer.remedy) = WhyNoNumber(*text, unit);
    }
    if (!IsGood(number.quality) && !had_number_[point]) continue;
    had_number_[point] = true;
    answer.readings.push_back({.point = point, .value = number.value, .quality = number.quality});
  }
  gone_at_.reset();
  if (!none && settings_.present > Duration::zero())
    gone_at_ = received.instant + settings_.present;
  Tell(Item::Kind::present, {!none}, answer);
  const bool known = !none && IsKnown(*text, received.instant);
  const bool asked = TakeAnswer(none ? std::string() : *text, received.instant);
  if (known || (asked && !none)) {
    ++repeats_;
  } else if (!none) {
    AddTag(*text, received, answer);
  }
  if (!none && (known || !asked)) Remember(*text, received.instant);
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

void ReaderConversation::OnEventsKept(std::string_view said) {
  if (std::exchange(recalled_, true)) return;
  // Before the first call of this function, tags were numbered from 1 on. Now the number of the
  // last tag before the restart is added.
  const auto before = ParseInteger<std::uint64_t>(said).value_or(0);
  counter_ += before;
  for (auto& tag : ring_) tag.counter += before;
}

/// True if this text came less than `same_tag` ago, so it counts as the same tag that is still
/// there.
bool ReaderConversation::IsKnown(const std::string& text, Instant now) {
  std::erase_if(latest_, [&](const auto& one) { return now - one.second >= settings_.same_tag; });
  return latest_.contains(text);
}

void ReaderConversation::Remember(const std::string& text, Instant now) {
  if (latest_.size() >= kMostKnown && !latest_.contains(text)) {
    latest_.erase(
        std::ranges::min_element(latest_, {}, [](const auto& one) { return one.second; }));
  }
  latest_.insert_or_assign(text, now);
}

/// True if this message counts as the reply to the command `r`; the reply looks like any message.
/// If the reader repeats its last tag after `r`, the tag is not new, however long ago it came. If
/// it repeats the tag twice, only the first of these messages is the reply, and the tag has come
/// again:
///   tag A, 10 s, r, A                  one tag, which stays
///   tag A, 10 s, r, A, A               the tag came again: two tags
///   tag A, 10 s, r, B, then B or none  B came and was read: A and B, once each
bool ReaderConversation::TakeAnswer(const std::string& text, Instant now) {
  std::erase_if(owed_, [now](Instant until) { return until < now; });
  const bool answer = !owed_.empty() && (text.empty() || text == last_);
  if (answer) owed_.pop_front();
  last_ = text;
  return answer;
}

void ReaderConversation::AddTag(const std::string& text, Now received, Answer& answer) {
  ring_.push_front({text, ++counter_, received.wall});
  if (ring_.size() > kRing) ring_.pop_back();
  TellRing(answer);
  if (!device_.events) return;
  answer.batch =
      EventBatch{.events = {{.code = kTagCode, .text = text}}, .said = std::to_string(counter_)};
}

/// Adds readings for all points of the stored tags. Points of a tag that has not come yet get no
/// value, because 0 would look like a tag.
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
