// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/conversation.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/common/designation.h"
#include "protocols/spabus/decode.h"
#include "protocols/spabus/expect.h"
#include "protocols/spabus/nack.h"
#include "protocols/spabus/plan.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"
#include "protocols/spabus/write_session.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr Address kIdentification{0, 'F', std::nullopt};
constexpr int kDoubtsBeforeForgetting = 3;
/// All that is asked of a relay which is not what its profile says: what it is now.
const Query kWhatIsIt{config::Group::slow, {}};

class SpaConversation final : public Conversation {
 public:
  SpaConversation(const config::Device& device, ContinuationChecksum& checksum)
      : device_(device),
        checksum_(checksum),
        points_(ReadablePoints(device.points)),
        settings_(ReadSettings(device.options)),
        writes_(settings_.password),
        slave_(ParseSlave(device.address).value()),
        most_items_(settings_.max_items),
        plan_(MakePlan(points_, most_items_)) {}

  std::span<const Query> Queries() const override {
    if (trouble_) return {&kWhatIsIt, 1};
    return plan_.queries();
  }
  const DeviceTrouble& trouble() const override { return trouble_; }
  void OnEnabled() override { writes_.OnEnabled(); }

  Result<Request> Ask(const Task& task, Instant) override {
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
        return Seal(ReadOf(slave_, plan_.block(task.query)));
      }
      case Task::Kind::write:
        return AskWrite(task);
    }
    return Error{"the SPA Bus does not know this kind of task"};
  }

  Answer OnFrame(const Task& task, const Request& request, View frame, Instant) override {
    Exchange exchange = Decode(request.bytes, frame, points_);
    Confirm(request, frame, exchange.answer);
    if (task.kind == Task::Kind::write) {
      return writes_.OnAnswer(std::move(exchange.answer), exchange.nack);
    }
    if (request.closes) {
      writes_.OnLeftover(exchange.answer);
      exchange.answer.then = Then::ask_again;
      return std::move(exchange.answer);
    }
    if (std::exchange(asked_name_, false)) return OnName(std::move(exchange.answer));
    const bool refused = exchange.nack && task.kind == Task::Kind::poll;
    if (refused && LearnFromRefusal(task.query, *exchange.nack)) {
      exchange.answer.then = Then::replan;
    }
    return std::move(exchange.answer);
  }

  Then OnFailure(const Task& task, const Request& request, Outcome outcome, Instant) override {
    if (outcome == Outcome::corrupt) checksum_.Doubt();
    const bool unsent = outcome == Outcome::line_down || outcome == Outcome::busy;
    if (std::exchange(asked_name_, false) && !unsent) {
      named_ = true;  // silence contradicts nothing
      return trouble_ ? Then::done : Then::ask_again;
    }
    if (task.kind == Task::Kind::write) return writes_.OnFailure(outcome);
    return request.closes && outcome != Outcome::line_down ? Then::ask_again : Then::done;
  }

  void OnReconnect() override {
    named_ = false;
    most_items_ = settings_.max_items;
    plan_.OnReconnect();
    writes_.Reset();
    checksum_.Forget();
  }

  bool ForgetRefusals() override { return plan_.ForgetRefusals(); }

  Outcome Check(View request, View frame) const override {
    const Answer answer = Decode(request, frame, points_).answer;
    const auto is_odd = [](const Reading& reading) {
      return reading.quality == Quality::bad_configuration;  // a text in place of a number
    };
    const bool odd = answer.outcome == Outcome::ok && std::ranges::any_of(answer.readings, is_odd);
    return odd ? Outcome::unexpected : answer.outcome;
  }

  Answer Interpret(View request, View frame) override {
    return Decode(request, frame, points_).answer;
  }

 private:
  bool KnowsNames() const {
    return !device_.identity.ignore &&
           (!device_.identity.names.empty() || !device_.identity.others.empty());
  }

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

  Request Seal(const Command& command) const {
    Request request;
    request.bytes = Encode(command, settings_.send_wildcard);
    request.expect = Expect(request.bytes, device_.options);
    request.expect.checksum &= ~kCoversAny | checksum_.accepted() | PinnedReading();
    return request;
  }

  /// The reading that the user chose; 0 = to be learned.
  int PinnedReading() const {
    const int chosen = ChecksumBits(settings_) & kCoversAny;
    return chosen == kCoversAny ? 0 : chosen;
  }

  Result<Request> AskWrite(const Task& task) {
    const config::Point& point = device_.points[task.point];
    if (trouble_) return Error{trouble_.text};
    if (point.access == config::Access::read) return Error{"'" + point.name + "' is read-only"};
    auto command = writes_.Next(slave_, task, point);
    if (!command) return Error{command.error()};
    Request request = Seal(*command);
    request.closes = writes_.closing();
    return request;
  }

  void Confirm(const Request& request, View frame, const Answer& answer) {
    if (answer.outcome != Outcome::ok || PinnedReading() != 0) return;
    const auto reply = ParseReply(frame);
    if (!reply || !reply->continued || reply->wildcard) return;
    const bool line_feed = (request.expect.checksum & kLineFeedCovered) != 0;
    checksum_.Confirm(MatchingReadings(frame, line_feed));
  }

  /// Whether the refusal changes what will be asked, so that one item does not cost the others.
  bool LearnFromRefusal(std::size_t query, int nack) {
    constexpr int kTooComplicated = 3;
    const NackRule& rule = RuleOf(nack);
    const std::size_t items = plan_.block(query).size();
    if (items == 1 ? !rule.missing : !rule.worth_splitting) return false;
    if (items == 1 || nack != kTooComplicated) {
      return plan_.OnRefused(query) != PlanChange::nothing;
    }
    most_items_ = std::min(most_items_, items / 2);
    plan_.Make();
    return true;
  }

  const config::Device& device_;
  ContinuationChecksum& checksum_;
  std::vector<ReadPoint> points_;
  const Settings settings_;
  WriteSession writes_;
  const unsigned slave_;
  std::size_t most_items_;  ///< in one request; fewer once the device has called it too many
  ItemPlan plan_;
  bool named_ = false;       ///< it has said what it is, since OnReconnect
  bool asked_name_ = false;  ///< the request under way asks for it
  DeviceTrouble trouble_;
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

void ContinuationChecksum::Forget() {
  accepted_ = kCoversAny;
  doubts_ = 0;
}

std::unique_ptr<Conversation> MakeConversation(const config::Device& device, SpaBus& bus) {
  return std::make_unique<SpaConversation>(device, bus.checksum);
}

}  // namespace baudgate::protocols::spabus
