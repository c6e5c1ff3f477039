// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/dcon/expect.h"

namespace baudgate::protocols::dcon {
namespace {

bool IsDigital(const std::optional<ReadAddress>& read) {
  return read && (read->form == Form::bits || read->form == Form::status);
}

/// In one task; behind them come a read and, of a counter, two more exchanges.
constexpr int kMostQuestions = kMostSteps - 3;

/// All that is asked of a module which is not what its profile says: what it is now.
const Query kWhatIsIt{config::Group::slow, {}};

}  // namespace

DconConversation::DconConversation(const config::Device& device)
    : device_(device),
      settings_(ReadSettings(device.options)),
      other_mode_(settings_),
      address_(ParseAddress(device.address).value()),
      plan_({}),
      identification_(device, settings_) {
  other_mode_.checksum = !settings_.checksum;
  PlanReads();
  probing_.emplace(settings_, reads_, plan_, ExpectedChannels("#"));
  totals_.emplace(settings_, reads_);
}

void DconConversation::PlanReads() {
  for (std::size_t i = 0; i < device_.points.size(); ++i) {
    const config::Point& point = device_.points[i];
    reads_.emplace_back();
    if (point.access == config::Access::write) continue;
    const auto read = ParseRead(point.read);
    if (!read) continue;  // check_point has told the user
    reads_.back() = *read;
    plan_.Add(point.group, i, {read->command, read->form});
  }
  plan_.Make();
}

Request DconConversation::MakeRequest(std::string_view command) const {
  Request request;
  request.bytes = BuildRequest(command, address_, settings_.checksum);
  request.expect = Expect(request.bytes, device_.options);
  return request;
}

Request DconConversation::MakeQuestion(const Identification::Question& question) const {
  const Settings& settings = question.other_mode ? other_mode_ : settings_;
  Request request;
  request.bytes = BuildRequest(question.command, address_, settings.checksum);
  request.expect = Expect(request.bytes, settings);
  // A module that does not know it is silent: the next question comes sooner.
  request.expect.repeatable = false;
  return request;
}

bool DconConversation::IsInOtherMode(View request) const {
  return settings_.identify &&
         std::ranges::any_of(std::array{kAskName, kAskType}, [&](const char* command) {
           return std::ranges::equal(MakeQuestion({command, true}).bytes, request);
         });
}

std::span<const Query> DconConversation::Queries() const {
  if (identification_.trouble()) return {&kWhatIsIt, 1};
  return plan_.queries();
}

/// What the task wants to send once it is known which module answers.
std::string DconConversation::CommandOf(const Task& task) const {
  if (task.kind == Task::Kind::write) return device_.points[task.point].write;
  if (identification_.trouble()) return kAskType;
  return plan_.block(task.query).key.command;
}

Result<Request> DconConversation::Ask(const Task& task, Instant) {
  question_.reset();
  if (task.kind == Task::Kind::probe) return AskProbe();
  const std::string command = CommandOf(task);
  question_ = identification_.Next(command);
  if (question_) return MakeQuestion(*question_);
  questions_ = 0;
  if (!identification_.Allows(command)) {
    return Error{trouble() ? trouble().text : "the module has not said in which mode it is"};
  }
  if (task.kind == Task::Kind::write) return AskWrite(task);
  read_back_.reset();
  if (totals_->WantsRestart(command) && identification_.Allows(kAskRestart)) {
    question_ = Identification::Question{kAskRestart, false};
    return MakeQuestion(*question_);
  }
  return MakeRequest(command);
}

Request DconConversation::AskProbe() {
  read_back_.reset();
  if (probing_->IsInOtherMode()) {
    question_ = Identification::Question{kAskName, true};
    return MakeQuestion(*question_);
  }
  const std::string command = probing_->Command(identification_);
  Request request = MakeRequest(command);
  request.steady = command == kAskName;
  request.distinct = probing_->IsOwn(command);
  return request;
}

Result<Request> DconConversation::AskWrite(const Task& task) {
  if (read_back_ && read_back_->point == task.point && read_back_->value == task.value) {
    return MakeRequest(reads_[task.point]->command);
  }
  read_back_.reset();
  const config::Point& point = device_.points[task.point];
  const auto write = ParseWrite(point.write);
  if (!write) return Error{write.error()};
  const auto command = FormatWrite(*write, task.value);
  if (!command) return Error{"point " + point.name + ": " + command.error()};
  return MakeRequest(*command);
}

/// The first query that sends the command; queries().size(): none does.
std::size_t DconConversation::QueryOf(std::string_view command) const {
  std::size_t query = 0;
  while (query < plan_.queries().size() && plan_.block(query).key.command != command) ++query;
  return query;
}

Answer DconConversation::OnFrame(const Task& task, const Request& request, View frame,
                                 Instant now) {
  const auto exchanged = Decode(request.bytes, frame);
  if (!exchanged) return Interpret(request.bytes, frame);
  const bool was_in_trouble = static_cast<bool>(trouble());
  // A probe is repeated without being asked for anew.
  if (!question_ && IsInOtherMode(request.bytes)) question_ = {kAskName, true};
  Answer answer = question_ ? OnIdentified(task, *exchanged) : OnAnswered(task, *exchanged, now);
  if (was_in_trouble != static_cast<bool>(trouble())) answer.then = Then::replan;
  return answer;
}

Answer DconConversation::OnAnswered(const Task& task, const Exchanged& exchanged, Instant now) {
  Answer answer = ReadingsOf(exchanged);
  const std::string& command = exchanged.command.text;
  if (task.kind == Task::Kind::write) {
    if (answer.outcome == Outcome::ok && IsClear(command) && command.size() == 3) {
      totals_->OnCleared("#" + command.substr(2));
    }
    return AfterWrite(task, std::move(answer));
  }
  if (task.kind == Task::Kind::probe) totals_->Leave(answer);
  const bool strange = answer.outcome == Outcome::ok && totals_->Take(command, answer, now);
  answer = AfterRead(task, exchanged, std::move(answer));
  counts_twice_ = strange && !counts_twice_ && task.kind == Task::Kind::poll;
  if (counts_twice_ && answer.then == Then::done) answer.then = Then::ask_again;
  return answer;
}

/// A question was answered; the task goes on, unless the module is another one.
Answer DconConversation::OnIdentified(const Task& task, const Exchanged& exchanged) {
  Learn(*std::exchange(question_, std::nullopt), exchanged.reply);
  probing_->OnPolled();
  Answer answer;
  answer.then = AfterQuestion(task);
  return answer;
}

Then DconConversation::AfterQuestion(const Task& task) {
  if (task.kind == Task::Kind::probe) return Then::done;
  const std::string command = CommandOf(task);
  const bool goes_on = !identification_.is_done() || identification_.Allows(command);
  // A task has few exchanges: the next poll goes on with the questions, at once.
  const bool enough = ++questions_ >= kMostQuestions && goes_on && identification_.Next(command);
  if (goes_on && !enough) return Then::ask_again;
  questions_ = 0;
  return enough ? Then::replan : Then::done;
}

/// What the answer to a poll or probe changes in the session.
Answer DconConversation::AfterRead(const Task& task, const Exchanged& exchanged, Answer answer) {
  const Command& command = exchanged.command;
  if (!ProvesLife(answer.outcome)) return answer;
  identification_.OnPolled();
  if (exchanged.reply.more_enabled) identification_.AskMaskAgain();
  if (task.kind == Task::Kind::probe) {
    probing_->OnAnswered(command.text);
  } else {
    probing_->OnPolled();
  }
  const std::size_t query = QueryOf(command.text);
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) change = plan_.OnAnswered(query);
  if (answer.outcome == Outcome::unsupported) change = plan_.OnRefused(query);
  if (change != PlanChange::nothing) answer.then = Then::replan;
  // What was polled may be what else would be asked: type and channel mask.
  const bool mask = command.text == kAskMask && exchanged.reply.form == Form::hex;
  if (settings_.identify && (command.text == kAskType || mask)) {
    Learn({mask ? kAskMask : kAskType, false}, exchanged.reply);
  }
  return answer;
}

void DconConversation::Learn(const Identification::Question& question, const DecodedReply& reply) {
  if (question.command == kAskRestart) {
    const auto* flag = reply.outcome == Outcome::ok && !reply.fields.empty()
                           ? std::get_if<std::uint64_t>(&reply.fields.front().value)
                           : nullptr;
    return totals_->OnRestart(flag != nullptr ? std::optional(*flag != 0) : std::nullopt);
  }
  identification_.OnAnswer(question, reply);
  settings_.enabled = identification_.mask().value_or(ReadSettings(device_.options).enabled);
}

Answer DconConversation::AfterWrite(const Task& task, Answer answer) {
  if (read_back_) {
    read_back_.reset();
    const auto own = std::ranges::find(answer.readings, task.point, &Reading::point);
    const bool differs = answer.outcome == Outcome::ok && own != answer.readings.end() &&
                         ToDouble(own->value) != ToDouble(task.value);
    if (differs) {
      answer.outcome = Outcome::refused;
      answer.reason = "the write was confirmed, but " + device_.points[task.point].name +
                      " reads back as " + ToText(own->value) +
                      "; if the output has moved all the same, the module sends its bytes in the "
                      "other order: set swap_bytes";
    }
    return answer;
  }
  // A bare '>' proves only that some module took something. An analog output may slew, so only a
  // digital one can be compared.
  const auto& read = reads_[task.point];
  if (answer.outcome == Outcome::ok && IsDigital(read)) {
    read_back_ = ReadBack{task.point, task.value};
    answer.then = Then::ask_again;
  }
  return answer;
}

Then DconConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                 Instant) {
  read_back_.reset();
  const bool silent = outcome == Outcome::no_reply;
  if (const auto question = std::exchange(question_, std::nullopt)) {
    if (!silent) questions_ = 0;
    if (task.kind == Task::Kind::probe) probing_->OnFailed(false, silent);
    // Damage is no silence: the same question is due again.
    const bool strange = outcome == Outcome::unexpected;
    if (task.kind == Task::Kind::probe || !(silent || strange)) return Then::done;
    if (question->command == kAskRestart) {
      totals_->OnNothing();
    } else {
      identification_.OnNothing(*question, strange);
    }
    return AfterQuestion(task);
  }
  counts_twice_ = false;
  if (task.kind == Task::Kind::poll && silent) {
    identification_.OnLost();
    totals_->OnLost();
  }
  if (outcome == Outcome::unexpected) identification_.AskMaskAgain();
  if (task.kind == Task::Kind::probe) {
    return probing_->OnFailed(request.distinct, silent) ? Then::ask_again : Then::done;
  }
  if (task.kind != Task::Kind::poll || !silent) return Then::done;
  return plan_.OnSilent(task.query) == PlanChange::nothing ? Then::done : Then::replan;
}

void DconConversation::OnReconnect() {
  read_back_.reset();
  question_.reset();
  questions_ = 0;
  counts_twice_ = false;
  identification_.OnReconnect();
  totals_->OnReconnect();
  probing_->OnReconnect();
  plan_.OnReconnect();
}

}  // namespace baudgate::protocols::dcon
