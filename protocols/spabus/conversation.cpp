// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/conversation.h"

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "protocols/common/designation.h"
#include "protocols/spabus/clock_offset.h"
#include "protocols/spabus/decode.h"
#include "protocols/spabus/event_session.h"
#include "protocols/spabus/events.h"
#include "protocols/spabus/expect.h"
#include "protocols/spabus/nack.h"
#include "protocols/spabus/plan.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"
#include "protocols/spabus/write_items.h"
#include "protocols/spabus/write_session.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr Address kIdentification{0, 'F', std::nullopt};
constexpr int kDoubtsBeforeForgetting = 3;
/// All that is asked of a relay which is not what its profile says: what it is now.
const Query kWhatIsIt{config::Group::slow, {}};
constexpr int kFailuresOfChannels = 2;
constexpr int kInputOverflow = 2;
constexpr int kOtherError = 9;

class SpaConversation final : public Conversation {
 public:
  SpaConversation(const config::Device& device, const Settings& settings, SpaBus& bus)
      : device_(device),
        checksum_(bus.checksum),
        clock_(bus.clock),
        points_(ReadablePoints(device.points)),
        settings_(settings),
        writes_(settings_.password),
        events_(device.events, device.recheck != config::Recheck::off),
        slave_(ParseSlave(device.address).value()),
        limits_{settings_.max_items, true, settings_.write_items},
        plan_(MakePlan(points_, limits_)) {}

  std::span<const Query> Queries() const override {
    if (trouble_) return {&kWhatIsIt, 1};
    return plan_.queries();
  }
  bool HasEvents() const override { return !trouble_ && events_.has_events(); }
  const DeviceTrouble& trouble() const override {
    return trouble_.text.empty() ? events_.remark() : trouble_;
  }
  void OnEnabled() override { writes_.OnEnabled(); }

  Result<Request> Ask(const Task& task, Instant now) override {
    const auto clock = clock_.Due(ClockSettingsOf(settings_), now);
    if (clock && task.kind != Task::Kind::write) return ClockRequest(*clock, {});
    switch (task.kind) {
      case Task::Kind::probe: {
        Request request = Seal(ReadOf(slave_, kIdentification, 0));
        request.steady = true;
        return request;
      }
      case Task::Kind::poll: {
        if (WantsName()) return Seal(ReadOf(slave_, kIdentification, 0));
        if (const auto leftover = writes_.Leftover(slave_)) {
          Request request = Seal(*leftover);
          request.closes = true;
          return request;
        }
        return AskItems(plan_.block(task.query));
      }
      case Task::Kind::write:
        return AskWrite(task);
      case Task::Kind::events:
        return Seal(WantsName() ? ReadOf(slave_, kIdentification, 0) : events_.Next(slave_));
      case Task::Kind::background:
        break;
    }
    return Error{"the SPA Bus does not know this kind of task"};
  }

  std::size_t WritesTogether(std::span<const PointValue> writes) const override {
    return CountTogether(writes, device_.points, limits_.written);
  }

  Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) override {
    Exchange exchange = Decode(request.bytes, frame, points_);
    Confirm(request, frame, exchange.answer);
    if (task.kind == Task::Kind::write) {
      const bool complicated = exchange.nack == kTooComplicated || exchange.nack == kSyntax;
      if (complicated && exchange.command->ItemCount() > 1) limits_.written = 1;
      return writes_.OnAnswer(std::move(exchange.answer), exchange.nack);
    }
    if (request.closes) {
      writes_.OnLeftover(exchange.answer, exchange.nack);
      exchange.answer.then = Then::ask_again;
      return std::move(exchange.answer);
    }
    if (std::exchange(asked_name_, false)) return OnName(std::move(exchange.answer));
    if (task.kind == Task::Kind::events) return events_.OnAnswer(std::move(exchange), now);
    if (task.kind != Task::Kind::poll) return std::move(exchange.answer);
    // "Other error" is worth one more try: reading again does no harm.
    if (exchange.nack == kOtherError && !std::exchange(repeated_, true)) {
      exchange.answer.then = Then::ask_again;
      return std::move(exchange.answer);
    }
    repeated_ = false;
    if (exchange.answer.outcome == Outcome::ok && IsChannelRange(task.query)) channels_work_ = true;
    AddOffsets(exchange, frame.size(), now);
    if (exchange.answer.outcome == Outcome::ok &&
        plan_.OnAnswered(task.query) != PlanChange::nothing) {
      exchange.answer.then = Then::replan;
    }
    if (exchange.nack) {
      // "Does not have it" takes three: a damaged reply may look like a refusal.
      if (!plan_.IsLastRefusal(task.query)) exchange.answer.readings.clear();
      if (LearnFromRefusal(task.query, *exchange.nack)) exchange.answer.then = Then::replan;
    }
    return std::move(exchange.answer);
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

  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant) override {
    repeated_ = false;
    if (outcome == Outcome::corrupt) checksum_.Doubt();
    const bool unsent = outcome == Outcome::line_down || outcome == Outcome::busy;
    if (std::exchange(asked_name_, false) && !unsent) {
      named_ = true;  // silence contradicts nothing; the next poll asks for values
      return Then::done;
    }
    if (task.kind == Task::Kind::write) return writes_.OnFailure(outcome);
    if (task.kind == Task::Kind::events) return events_.OnFailure(outcome);
    if (task.kind == Task::Kind::poll && !request.closes && DoubtChannels(task.query, outcome)) {
      return Then::replan;
    }
    return request.closes && outcome != Outcome::line_down ? Then::ask_again : Then::done;
  }

  std::optional<Request> Instead(const Request& request, Outcome, Instant) override {
    const auto command = ParseRequest(request.bytes).command;
    if (!command || command->write || command->category != 'L') return std::nullopt;
    return Seal(events_.Instead(slave_));
  }

  void OnUnsettledWrite() override { writes_.OnUnsettledWrite(); }

  void OnReconnect() override {
    named_ = false;
    limits_ = {settings_.max_items, true, settings_.write_items};
    channels_work_ = repeated_ = sends_wildcard_ = false;
    channel_failures_ = 0;
    plan_.OnReconnect();
    writes_.Reset();
    events_.OnReconnect();
    checksum_.Forget();
  }

  bool ForgetRefusals() override { return plan_.ForgetRefusals(); }

  Outcome Check(View request, View frame) const override {
    const Exchange exchange = Decode(request, frame, points_);
    const Answer& answer = exchange.answer;
    const bool lists = exchange.command && IsEventList(exchange.command->category);
    if (lists && answer.outcome == Outcome::ok && !LooksLikeEvents(exchange.data)) {
      return Outcome::unexpected;
    }
    const auto is_odd = [](const Reading& reading) {
      return reading.quality == Quality::bad_configuration;  // a text in place of a number
    };
    const bool clock = exchange.command && AsksOffset(*exchange.command);
    if (clock && answer.outcome == Outcome::ok && !SecondsOf(exchange.data)) {
      return Outcome::unexpected;
    }
    const bool odd = answer.outcome == Outcome::ok && std::ranges::any_of(answer.readings, is_odd);
    return odd ? Outcome::unexpected : answer.outcome;
  }

  Answer Interpret(View request, View frame) override {
    Exchange exchange = Decode(request, frame, points_);
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
    if (limits_.items < settings_.max_items) {
      say("at most " + Plural(limits_.items, "item") + " in one request");
    }
    if (!limits_.channels) say("one channel in one request");
    if (limits_.written < settings_.write_items) say("one value in one write");
    if (channels_work_) say("several channels in one request");
    const bool tells = settings_.send_seconds > Duration() || settings_.send_date > Duration();
    if (tells && !clock_.right())
      say("not told the time: this machine's clock is not known to be synchronised");
    if (sends_wildcard_) say("XX in place of its checksums");
    if (const char reading = checksum_.letter()) {
      say(std::string("continued replies with checksum ") + reading);
    }
    return text;
  }

 private:
  bool AsksOffset(const Command& command) const {
    return command.category == kSeconds && !command.write &&
           std::ranges::any_of(points_, &ReadPoint::offset);
  }

  Request AskItems(const Block<Row>& block) {
    const Command command = ReadOf(slave_, block);
    Request request = Seal(command);
    request.stamped = AsksOffset(command);
    if (request.stamped) offset_.OnAsked();
    return request;
  }

  void AddOffsets(Exchange& exchange, std::size_t characters, Instant now) {
    if (!exchange.command || !AsksOffset(*exchange.command)) return;
    if (exchange.answer.outcome != Outcome::ok) return;
    const auto offset = offset_.Of(exchange.data, characters, now, clock_.right());
    for (const ReadPoint& point : points_) {
      if (!point.offset) continue;
      exchange.answer.readings.push_back({point.index, offset.value, offset.quality, {}});
    }
  }

  bool KnowsNames() const { return !device_.identity.ignore && !device_.identity.names.empty(); }

  /// Before the first poll, and in place of all polls where the relay is another.
  bool WantsName() {
    asked_name_ = KnowsNames() && (!named_ || trouble_);
    return asked_name_;
  }

  /// A relay that has no designation contradicts nothing.
  Answer OnName(Answer answer) {
    named_ = true;
    const bool was_in_trouble = static_cast<bool>(trouble_);
    const auto name = std::ranges::find_if(answer.readings, [](const Reading& reading) {
      return std::holds_alternative<std::string>(reading.value);
    });
    if (answer.outcome == Outcome::ok && name != answer.readings.end()) {
      trouble_ = JudgeName(device_.identity, std::get<std::string>(name->value));
    }
    answer = {};
    const bool changed = was_in_trouble != static_cast<bool>(trouble_);
    answer.then = changed ? Then::replan : trouble_ ? Then::done : Then::ask_again;
    return answer;
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

  /// The reading that the user chose; 0 = to be learned.
  int PinnedReading() const {
    const int chosen = ChecksumBits(settings_) & kCoversAny;
    return chosen == kCoversAny ? 0 : chosen;
  }

  Result<Request> AskWrite(const Task& task) {
    if (trouble_) return Error{trouble_.text};
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

  bool IsChannelRange(std::size_t query) const {
    return plan_.block(query).key.across && plan_.block(query).size() > 1;
  }

  /// Whether the refusal changes what will be asked, so that one item does not cost the others.
  bool LearnFromRefusal(std::size_t query, int nack) {
    const NackRule& rule = RuleOf(nack);
    const std::size_t items = plan_.block(query).size();
    const bool unknown = nack == kTooComplicated || nack == kSyntax;
    if (unknown && IsChannelRange(query) && !channels_work_) return ForgoChannels();
    if (items > 1 && (nack == kTooComplicated || nack == kInputOverflow)) {
      limits_.items = std::min(limits_.items, items / 2);
      plan_.Make();
      return true;
    }
    if (items == 1 ? !rule.missing : !rule.worth_splitting) return false;
    return plan_.OnRefused(query) != PlanChange::nothing;
  }

  bool ForgoChannels() {
    limits_.channels = false;
    plan_.Make();
    return true;
  }

  /// A range of channels that has never been answered may be what the device does not understand:
  /// some say nothing then, or give one value.
  bool DoubtChannels(std::size_t query, Outcome outcome) {
    if (outcome != Outcome::no_reply && outcome != Outcome::unexpected) return false;
    if (channels_work_ || query >= plan_.queries().size() || !IsChannelRange(query)) return false;
    return ++channel_failures_ >= kFailuresOfChannels && ForgoChannels();
  }

  const config::Device& device_;
  ContinuationChecksum& checksum_;
  ClockMessages& clock_;
  std::vector<ReadPoint> points_;
  const Settings settings_;
  WriteSession writes_;
  EventSession events_;
  const unsigned slave_;
  RequestLimits limits_;  ///< less once the device has called it too much
  ItemPlan plan_;
  ClockOffset offset_;
  bool named_ = false;       ///< it has said what it is, since OnReconnect
  bool asked_name_ = false;  ///< the request under way asks for it
  DeviceTrouble trouble_;
  int channel_failures_ = 0;     ///< of ranges of channels, none answered so far
  bool channels_work_ = false;   ///< a range of channels was answered
  bool repeated_ = false;        ///< the present poll, because of NACK 9
  bool sends_wildcard_ = false;  ///< the latest good reply had XX
};

}  // namespace

void ContinuationChecksum::Confirm(int matching) {
  doubts_ = 0;
  const int narrowed = accepted_ & matching;
  if (narrowed != 0) accepted_ = narrowed;
}

void ContinuationChecksum::Doubt() {
  if (++doubts_ >= kDoubtsBeforeForgetting) Forget();
}

char ContinuationChecksum::letter() const {
  for (const auto& [reading, letter] : {std::pair(kCoversAll, 'a'),
                                        {kCoversNoLineEnds, 'b'},
                                        {kCoversCharacters, 'c'},
                                        {kCoversLastLine, 'd'}}) {
    if (accepted_ == reading) return letter;
  }
  return 0;
}

void ContinuationChecksum::Forget() {
  accepted_ = kCoversAny;
  doubts_ = 0;
}

std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus) {
  return std::make_unique<SpaConversation>(device, settings, bus);
}

}  // namespace baudgate::protocols::spabus
