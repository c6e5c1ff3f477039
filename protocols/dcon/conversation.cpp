// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/dcon/expect.h"

namespace baudgate::protocols::dcon {
namespace {

/// In one task; beside them come two broadcasts and, of a counter, three reads.
constexpr int kMostQuestions = kMostSteps - 5;

/// How often a count is read once more in one poll.
constexpr int MostCounts(Totals::Again why) {
  if (why == Totals::Again::no) return 0;
  return why == Totals::Again::has_moved ? 1 : 2;
}

/// All that is asked of a module which is not what its profile says: what it is now.
const Query kWhatIsIt{config::Group::slow, {}};

}  // namespace

DconConversation::DconConversation(const config::Device& device, const Settings& settings,
                                   DconBus& bus)
    : device_(device),
      settings_(settings),
      other_mode_(settings_),
      address_(ParseAddress(device.address).value()),
      group_(bus.Of(settings_.checksum)),
      plan_({.may_join = {}, .refusals = 3}),
      identification_(device, settings_),
      sampling_(group_, device.poll) {
  other_mode_.checksum = !settings_.checksum;
  PlanReads();
  probing_.emplace(settings_, reads_, plan_, ExpectedChannels("#"));
  totals_.emplace(settings_, reads_);
}

void DconConversation::PlanReads() {
  for (std::size_t i = 0; i < device_.points.size(); ++i) {
    const config::Point& point = device_.points[i];
    // check_point has told the user of what cannot be parsed.
    const auto write = ParseWrite(point.write);
    const bool written = point.access != config::Access::read && write;
    writes_.push_back(written ? std::optional(*write) : std::nullopt);
    reads_.emplace_back();
    const auto read = ParseRead(point.read);
    if (point.access != config::Access::write && read) {
      reads_.back() = *read;
      plan_.Add(point.group, i, {read->command, read->form});
    }
    outputs_.push_back(GroupOf(reads_.back(), writes_.back(), settings_));
  }
  plan_.Make();
}

Request DconConversation::MakeBroadcast(std::string_view text) const {
  Request request;
  request.bytes = BuildBroadcast(text, settings_.checksum);
  request.expect = Expect(request.bytes, settings_);
  request.prepares = true;
  return request;
}

Request DconConversation::MakeRequest(std::string_view command) const {
  Request request;
  request.bytes = BuildRequest(command, address_, settings_.checksum);
  request.expect = Expect(request.bytes, settings_);
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

Result<Request> DconConversation::Ask(const Task& task, Instant now) {
  question_.reset();
  if (IsHostDue(now)) return MakeBroadcast(kHostIsThere);
  if (task.kind == Task::Kind::probe) return AskProbe();
  if (task.kind == Task::Kind::poll && anew_) return AskAnew();
  const std::string command = CommandOf(task);
  question_ = identification_.Next(command);
  if (question_) return MakeQuestion(*question_);
  questions_ = 0;
  if (!identification_.Allows(command)) {
    return Error{trouble() ? trouble().text : "the module has not said in which mode it is"};
  }
  return task.kind == Task::Kind::write ? AskWrite(task, now) : AskRead(command, now);
}

bool DconConversation::IsHostDue(Instant now) const {
  const Duration period = settings_.host_watchdog;
  return period > Duration::zero() && (!group_.told_at || now - *group_.told_at >= period);
}

/// No module waits for the host because another one is silent.
std::optional<Request> DconConversation::Instead(const Request& request, Outcome, Instant now) {
  if (!request.expect.repeatable || !IsHostDue(now)) return std::nullopt;
  return MakeBroadcast(kHostIsThere);
}

/// It has answered that before, so that silence is repeated, and then fails the task as any other.
Request DconConversation::AskAnew() {
  question_ = anew_;
  Request request = MakeQuestion(*question_);
  request.expect.repeatable = true;
  return request;
}

Result<Request> DconConversation::AskRead(const std::string& command, Instant now) {
  certain_.reset();
  if (totals_->WantsRestart(command) && identification_.Allows(kAskRestart)) {
    question_ = Identification::Question{kAskRestart, false};
    return MakeQuestion(*question_);
  }
  if (command == kAskSample) {
    if (sampling_.WantsNew(now)) return MakeBroadcast(kTakeSample);
    sampling_.OnAsked();
  }
  return MakeRequest(command);
}

Request DconConversation::AskProbe() {
  certain_.reset();
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
  Answer answer =
      question_ ? OnIdentified(task, *exchanged, now) : OnAnswered(task, *exchanged, now);
  if (was_in_trouble != static_cast<bool>(trouble())) answer.then = Then::replan;
  return answer;
}

Answer DconConversation::OnAnswered(const Task& task, const Exchanged& exchanged, Instant now) {
  if (task.kind == Task::Kind::write) return OnWritten(task, exchanged, now);
  Answer answer = ReadingsOf(exchanged);
  const std::string& command = exchanged.command.text;
  if (command == kAskSample && task.kind == Task::Kind::poll) TakeSample(exchanged, answer);
  if (task.kind == Task::Kind::probe) totals_->Leave(answer);
  const auto again =
      answer.outcome == Outcome::ok ? totals_->Take(command, answer, now) : Totals::Again::no;
  answer = AfterRead(task, exchanged, std::move(answer));
  const bool counts_again = task.kind == Task::Kind::poll && counted_again_ < MostCounts(again);
  counted_again_ = counts_again ? counted_again_ + 1 : 0;
  if (answer.then != Then::done || task.kind != Task::Kind::poll) return answer;
  answer.then = counts_again ? Then::ask_again : AfterPoll(command, now);
  return answer;
}

/// Readings that may be of an older sample than the one that was asked for do not count.
void DconConversation::TakeSample(const Exchanged& exchanged, Answer& answer) {
  if (answer.outcome != Outcome::ok) return;
  if (const auto why = sampling_.WhyNot(exchanged.reply.first_fetch)) {
    answer.readings.clear();
    answer.reason = *why;
  }
}

Then DconConversation::OnSent(const Task&, const Request& request, Instant now) {
  if (request.bytes == MakeBroadcast(kHostIsThere).bytes) {
    group_.told_at = now;
  } else {
    sampling_.OnSampled(now);
  }
  return Then::ask_again;
}

std::string DconConversation::WhatIsLearned() const {
  if (!sampling_.IsOvertaken()) return {};
  return "its samples ($4) are overtaken by those of other modules: modules that are read together "
         "need the same poll";
}

/// A question was answered; the task goes on, unless the module is another one.
Answer DconConversation::OnIdentified(const Task& task, const Exchanged& exchanged, Instant now) {
  Learn(*std::exchange(question_, std::nullopt), exchanged.reply);
  probing_->OnPolled();
  Answer answer;
  answer.then = anew_ ? AfterPoll(CommandOf(task), now) : AfterQuestion(task);
  return answer;
}

/// What is due is asked anew behind the read and not before it: the replies to these questions say
/// whose they are, and of a task only the first request waits for the proof that its reply needs.
Then DconConversation::AfterPoll(const std::string& command, Instant now) {
  anew_.reset();
  if (questions_ < kMostQuestions) anew_ = identification_.NextAnew(command, now);
  questions_ = anew_ ? questions_ + 1 : 0;
  return anew_ ? Then::ask_again : Then::done;
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
  const bool digital = exchanged.reply.form == Form::bits || exchanged.reply.form == Form::status;
  const auto* word = answer.outcome == Outcome::ok && digital
                         ? std::get_if<std::uint64_t>(&exchanged.reply.fields.front().value)
                         : nullptr;
  if (word != nullptr) words_[command.text] = *word;
  const std::size_t query = QueryOf(command.text);
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) change = plan_.OnAnswered(query);
  if (answer.outcome == Outcome::unsupported) {
    // "Does not have it" takes three: a damaged reply may look like a refusal.
    if (!plan_.IsLastRefusal(query)) answer.readings.clear();
    change = plan_.OnRefused(query);
  }
  for (const std::size_t point : plan_.SilentlyRefused()) {
    answer.readings.push_back({point, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
  }
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

Then DconConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                 Instant) {
  const bool silent = outcome == Outcome::no_reply;
  const bool read = std::exchange(anew_, std::nullopt).has_value();
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
    return read ? Then::done : AfterQuestion(task);
  }
  counted_again_ = 0;
  certain_.reset();
  const bool several = task.kind == Task::Kind::write && !task.also.empty() && !request.prepares;
  if (several && silent) alone_ = true;
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
  question_.reset();
  anew_.reset();
  questions_ = 0;
  counted_again_ = 0;
  certain_.reset();
  words_.clear();
  alone_ = false;
  sampling_.OnReconnect();
  identification_.OnReconnect();
  totals_->OnReconnect();
  probing_->OnReconnect();
  plan_.OnReconnect();
}

}  // namespace baudgate::protocols::dcon
