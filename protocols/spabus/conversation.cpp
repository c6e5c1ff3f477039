// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/conversation.h"

#include <algorithm>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "protocols/common/identification.h"
#include "protocols/spabus/events.h"
#include "protocols/spabus/rules.h"
#include "protocols/spabus/writing.h"

namespace baudgate::protocols::spabus {
namespace {

bool AreNeighbours(std::uint32_t a, std::uint32_t b) { return a + 1 == b || b + 1 == a; }

/// True if the point is read together with the same item of other channels: 1I1, 2I1, 3I1. A point
/// that has a neighbour in its own channel is read with this neighbour. Channel 0 never counts,
/// because it contains the items that are common to all channels.
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

std::vector<ReadPoint> SortedByAddress(std::vector<ReadPoint> points) {
  std::ranges::stable_sort(points, {}, &ReadPoint::address);
  return points;
}

constexpr int kFailuresOfChannels = 2;
constexpr int kInputOverflow = 2;

}  // namespace

ItemReads::ItemReads(const config::Device& device, const Settings& settings)
    : settings_(settings),
      points_(ReadablePoints(device.points)),
      by_address_(SortedByAddress(points_)),
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

/// Handles a refused query: changes the queries, so that one item does not block the others.
bool ItemReads::TakeRefusal(std::size_t query, int nack, Answer& answer, Instant now) {
  // A damaged reply can look like a refusal, so an item counts as missing only after three
  // refusals.
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
  const PlanChange change = plan_.OnRefused(query, now);
  answer.divides = change == PlanChange::split;
  return change != PlanChange::nothing;
}

/// Handles a failed query for several items. Some relays do not support a range of channels and
/// answer it with nothing, or with only one value: after two failures no such range is requested.
/// If the relay is silent to several items of one channel, but answers other requests, it is asked
/// for fewer items at once.
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
    say("it accepts at most " + Plural(limits_.items, "item") + " in one request");
  }
  if (!limits_.channels) say("it accepts only one channel in one request");
  if (limits_.written < settings_.write_items) say("it accepts only one value in one write");
  if (channels_work_) say("it accepts several channels in one request");
  return text;
}

bool RelayIdentity::WantsName() {
  const bool known = !identity_.ignore && !identity_.names.empty();
  asked_ = known && (!named_ || trouble_);
  return asked_;
}

/// Compares the designation in the reply with the profile. A relay without a designation
/// contradicts no profile.
Answer RelayIdentity::TakeName(Answer answer) {
  named_ = true;
  const bool was_in_trouble = static_cast<bool>(trouble_);
  const auto name = std::ranges::find_if(answer.readings, [](const Reading& reading) {
    return std::holds_alternative<std::string>(reading.value);
  });
  if (answer.outcome == Outcome::ok && name != answer.readings.end()) {
    trouble_ = JudgeName(identity_, std::get<std::string>(name->value));
  }
  answer = {};
  const bool changed = was_in_trouble != static_cast<bool>(trouble_);
  answer.then = changed ? Then::replan : trouble_ ? Then::done : Then::ask_again;
  return answer;
}

namespace {

constexpr Address kIdentification{0, 'F', std::nullopt};
/// The only query for a relay that is not what its profile requires. It reads the designation F.
const Query kIdentificationQuery{config::Group::slow, {}};
constexpr std::string_view kMayBeOpen = "password may be open";

class SpaConversation final : public Conversation {
 public:
  SpaConversation(const config::Device& device, const Settings& settings, SpaBus& bus)
      : device_(device),
        checksum_(bus.checksum),
        clock_(bus.clock),
        settings_(settings),
        writes_(settings_.password),
        events_(device.events, device.recheck != config::Recheck::off),
        slave_(ParseSlave(device.address).value()),
        reads_(device, settings_),
        identity_(device.identity) {}

  std::span<const Query> Queries() const override {
    if (identity_.trouble()) return {&kIdentificationQuery, 1};
    return reads_.Queries();
  }
  bool HasEvents() const override { return !identity_.trouble() && events_.has_events(); }
  const DeviceTrouble& trouble() const override {
    return identity_.trouble().text.empty() ? events_.remark() : identity_.trouble();
  }
  void OnEnabled() override { writes_.OnEnabled(); }

  Result<Request> Ask(const Task& task, Instant now) override {
    // A probe reads the name F, too. If a request for the name waits until the probe ends,
    // identity_ still expects the name, and takes it from the reply to the probe.
    const bool is_probe = task.kind == Task::Kind::probe;
    if (!is_probe) identity_.OnAsk();
    const auto clock = clock_.Due(ClockSettingsOf(settings_), now);
    if (clock && task.kind != Task::Kind::write) return ClockRequest(*clock, {});
    switch (task.kind) {
      case Task::Kind::probe: {
        Request request = Seal(ReadOf(slave_, kIdentification, 0));
        request.steady = true;
        return request;
      }
      case Task::Kind::poll: {
        if (identity_.WantsName()) return Seal(ReadOf(slave_, kIdentification, 0));
        if (const auto leftover = writes_.Leftover(slave_)) {
          Request request = Seal(*leftover);
          request.closes = true;
          return request;
        }
        return AskItems(task.query);
      }
      case Task::Kind::write:
        return AskWrite(task);
      case Task::Kind::events:
        return Seal(identity_.WantsName() ? ReadOf(slave_, kIdentification, 0)
                                          : events_.Next(slave_));
      case Task::Kind::background:
        break;
    }
    return Error{"the SPA Bus does not support this kind of task"};
  }

  std::size_t WritesTogether(std::span<const PointValue> writes) const override {
    return CountTogether(writes, device_.points, reads_.limits().written);
  }

  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override {
    Exchange exchange = Decode(request.bytes, frame, reads_.by_address());
    Confirm(request, frame, exchange.answer);
    if (task.kind == Task::Kind::write) {
      const bool complicated = exchange.nack == kTooComplicated || exchange.nack == kSyntax;
      if (complicated && exchange.command->ItemCount() > 1) reads_.WriteAlone();
      return writes_.OnAnswer(std::move(exchange.answer), exchange.nack);
    }
    if (request.closes) {
      writes_.OnLeftover(exchange.answer, exchange.nack);
      exchange.answer.then = Then::ask_again;
      return std::move(exchange.answer);
    }
    if (identity_.TakeAsked()) return identity_.TakeName(std::move(exchange.answer));
    if (task.kind == Task::Kind::events) return events_.OnAnswer(std::move(exchange), now);
    if (task.kind != Task::Kind::poll) {
      // Only polls record whether the relay has an item.
      if (exchange.answer.outcome != Outcome::ok) exchange.answer.readings.clear();
      return std::move(exchange.answer);
    }
    return TakeRead(task.query, std::move(exchange), frame.size(), now);
  }

  void Stamp(Request& request, Now arrives, Duration character) override {
    const bool asks = request.expect.reply != Expectation::Reply::none;
    if (asks) return offset_.OnSent(arrives, character);
    request = ClockRequest(ItemOf(request), arrives.wall + settings_.clock_delay);
  }

  Then OnSent(const Task&, const Request& request, Instant now) override {
    clock_.OnSent(ItemOf(request), now);
    return Then::ask_again;
  }

  void OnHostClock(bool right) override { clock_.OnHostClock(right); }

  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant now) override {
    repeated_ = false;
    if (outcome == Outcome::corrupt) checksum_.Doubt();
    const bool is_probe = task.kind == Task::Kind::probe;
    if (!is_probe && identity_.TakeAsked() && outcome != Outcome::busy) {
      identity_.OnNoName();
      return Then::done;
    }
    if (task.kind == Task::Kind::write) return writes_.OnFailure(outcome, request.closes);
    if (task.kind == Task::Kind::events) return events_.OnFailure(outcome);
    if (request.closes) return writes_.OnLeftoverFailure(outcome);
    const bool replans =
        task.kind == Task::Kind::poll && reads_.OnFailure(task.query, outcome, now);
    return replans ? Then::replan : Then::done;
  }

  std::optional<Request> Instead(const Request& request, Outcome, Instant) override {
    const auto command = ParseRequest(request.bytes).command;
    if (!command || command->write || command->category != 'L') return std::nullopt;
    return Seal(events_.Instead(slave_));
  }

  void OnUnsettledWrite() override { writes_.OnUnsettledWrite(); }
  const std::string& Memory() const override {
    static const std::string kOpen(kMayBeOpen);
    static const std::string kNothing;
    return writes_.may_be_open() ? kOpen : kNothing;
  }
  void Recall(std::string_view memory, Now) override {
    if (memory == kMayBeOpen) writes_.OnUnsettledWrite();
  }

  void OnReconnect() override {
    repeated_ = sends_wildcard_ = false;
    identity_.OnReconnect();
    reads_.OnReconnect();
    writes_.Reset();
    events_.OnReconnect();
    checksum_.Forget();
  }

  bool ForgetRefusals() override { return reads_.ForgetRefusals(); }

  Outcome Check(View request, View frame) const override {
    const Exchange exchange = Decode(request, frame, reads_.by_address());
    const Answer& answer = exchange.answer;
    const bool lists = exchange.command && IsEventList(exchange.command->category);
    if (lists && answer.outcome == Outcome::ok && !LooksLikeEvents(exchange.data)) {
      return Outcome::unexpected;
    }
    const auto is_odd = [](const Reading& reading) {
      // The reply has a text in place of a number.
      return reading.quality == Quality::bad_configuration;
    };
    const bool clock = exchange.command && AsksOffset(*exchange.command);
    if (clock && answer.outcome == Outcome::ok && !SecondsOf(exchange.data)) {
      return Outcome::unexpected;
    }
    const bool odd = answer.outcome == Outcome::ok && std::ranges::any_of(answer.readings, is_odd);
    return odd ? Outcome::unexpected : answer.outcome;
  }

  Answer Interpret(View request, View frame) override {
    Exchange exchange = Decode(request, frame, reads_.by_address());
    const bool written = exchange.command && exchange.command->write;
    if (written && exchange.answer.outcome == Outcome::ok) {
      exchange.answer.readings = WrittenBy(*exchange.command);
    }
    return std::move(exchange.answer);
  }

  std::string WhatIsLearned() const override {
    std::string text;
    const auto say = [&text](const std::string& what) {
      text += (text.empty() ? "" : "; ") + what;
    };
    if (const std::string reads = reads_.Learned(); !reads.empty()) say(reads);
    if (sends_wildcard_) say("it sends XX instead of checksums");
    if (const char reading = checksum_.letter()) {
      say(std::string(
              "its replies in several lines have a checksum of the form (continuation_checksum) ") +
          reading);
    }
    return text;
  }
  bool LacksTime() const override {
    const bool tells = settings_.send_seconds > Duration() || settings_.send_date > Duration();
    return tells && !clock_.right();
  }

 private:
  bool AsksOffset(const Command& command) const {
    return command.category == kSeconds && !command.write &&
           std::ranges::any_of(reads_.points(), &ReadPoint::offset);
  }

  Request AskItems(std::size_t query) {
    const Command command = reads_.Ask(slave_, query);
    Request request = Seal(command);
    request.stamped = AsksOffset(command);
    if (request.stamped) offset_.OnAsked();
    return request;
  }

  void AddOffsets(Exchange& exchange, std::size_t characters, Instant now) {
    if (!exchange.command || !AsksOffset(*exchange.command)) return;
    if (exchange.answer.outcome != Outcome::ok) return;
    const auto offset = offset_.Of(exchange.data, characters, now, clock_.right());
    for (const ReadPoint& point : reads_.points()) {
      if (!point.offset) continue;
      exchange.answer.readings.push_back({point.index, offset.value, offset.quality, {}});
    }
  }

  static char ItemOf(const Request& request) {
    return ParseRequest(request.bytes).command->category;
  }

  Request ClockRequest(char item, WallTime arrives) const {
    Request request = Seal(WriteOf(kBroadcast, {0, item, std::nullopt},
                                   ClockText(item, arrives, settings_.date_zone)));
    request.stamped = true;
    return request;
  }

  Request Seal(const Command& command) const {
    Request request;
    request.bytes = Encode(command, settings_.send_wildcard);
    request.expect = Expect(request.bytes, settings_);
    request.expect.checksum &= ~kCoversAny | checksum_.accepted() | PinnedReading();
    return request;
  }

  /// Returns the checksum variant that the option continuation_checksum names; 0: it is learned.
  int PinnedReading() const {
    const int chosen = ChecksumBits(settings_) & kCoversAny;
    return chosen == kCoversAny ? 0 : chosen;
  }

  Result<Request> AskWrite(const Task& task) {
    if (identity_.trouble()) return Error{identity_.trouble().text};
    for (const PointValue& one : ValuesOf(task)) {
      const config::Point& point = device_.points[one.point];
      if (point.access == config::Access::read) return Error{"'" + point.name + "' is read-only"};
    }
    auto command = writes_.Next(slave_, task, device_.points);
    if (!command) return Error{command.error()};
    Request request = Seal(*command);
    request.closes = writes_.closing();
    request.prepares = writes_.opening();
    return request;
  }

  void Confirm(const Request& request, View frame, const Answer& answer) {
    if (answer.outcome != Outcome::ok) return;
    const auto reply = ParseReply(frame);
    if (reply) sends_wildcard_ = reply->wildcard;
    if (!reply || !reply->continued || reply->wildcard || PinnedReading() != 0) return;
    const bool line_feed = (request.expect.checksum & kLineFeedCovered) != 0;
    checksum_.Confirm(MatchingReadings(frame, line_feed));
  }

  Answer TakeRead(std::size_t query, Exchange exchange, std::size_t characters, Instant now) {
    Answer& answer = exchange.answer;
    // A poll is repeated once after "other error" (NACK 9), because a read has no side effect.
    if (exchange.nack == kOtherError && !std::exchange(repeated_, true)) {
      answer.then = Then::ask_again;
      return std::move(answer);
    }
    repeated_ = false;
    AddOffsets(exchange, characters, now);
    const bool changed = exchange.nack
                             ? reads_.TakeRefusal(query, *exchange.nack, answer, now)
                             : answer.outcome == Outcome::ok && reads_.OnAnswered(query, now);
    if (changed) answer.then = Then::replan;
    return std::move(answer);
  }

  const config::Device& device_;
  ContinuationChecksum& checksum_;
  ClockMessages& clock_;
  const Settings settings_;
  WriteSession writes_;
  EventSession events_;
  const unsigned slave_;
  ItemReads reads_;
  RelayIdentity identity_;
  ClockOffset offset_;
  bool repeated_ = false;        ///< true: the current poll was repeated because of NACK 9
  bool sends_wildcard_ = false;  ///< true: the latest good reply had XX as its checksum
};

}  // namespace

std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus) {
  return std::make_unique<SpaConversation>(device, settings, bus);
}

}  // namespace baudgate::protocols::spabus
