// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <algorithm>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/dcon/rules.h"

namespace baudgate::protocols::dcon {
namespace {

Request MakeRequest(Bytes bytes, const Settings& settings) {
  Request request;
  request.bytes = std::move(bytes);
  request.expect = Expect(request.bytes, settings);
  return request;
}

}  // namespace

Requests::Requests(std::uint8_t address, const Settings& settings)
    : address_(address), settings_(settings), other_mode_(settings) {
  other_mode_.checksum = !settings.checksum;
}

Request Requests::Own(std::string_view command) const {
  return MakeRequest(BuildRequest(command, address_, settings_.checksum), settings_);
}

Request Requests::Broadcast(std::string_view text) const {
  Request request = MakeRequest(BuildBroadcast(text, settings_.checksum), settings_);
  request.prepares = true;
  return request;
}

/// Builds the request for an identification question. A question without an answer is not repeated:
/// a module that does not support it never answers, and the next question is sent sooner this way.
Request Requests::Question(const Identification::Question& question) const {
  const Settings& settings = question.other_mode ? other_mode_ : settings_;
  Request request =
      MakeRequest(BuildRequest(question.command, address_, settings.checksum), settings);
  request.expect.repeatable = false;
  request.prepares = true;
  return request;
}

bool Requests::IsInOtherMode(View request) const {
  return settings_.identify &&
         std::ranges::any_of(std::array{kAskName, kAskType}, [&](const char* command) {
           return std::ranges::equal(BuildRequest(command, address_, other_mode_.checksum),
                                     request);
         });
}

namespace {

std::string Label(const Command& request, const DecodedReply& reply, const Field& field) {
  const bool joined = reply.form == Form::numbers || reply.form == Form::words;
  return joined ? request.text + "[" + std::to_string(field.channel) + "]" : request.text;
}

}  // namespace

std::optional<Form> ReplyReader::PlannedForm(std::string_view command) const {
  if (settings_.channel_types && InputOfQuestion(command)) return Form::text;
  if (counts_ && command == kAskRestart) return Form::hex;
  return places_.FormOf(command);
}

std::optional<Exchanged> ReplyReader::Read(View request, View frame) const {
  const Settings& settings = requests_.SettingsFor(request);
  const auto command = ParseRequest(request, settings.checksum);
  if (!command) return std::nullopt;
  if (IsOfOwnMode(request, frame)) {
    DecodedReply late;
    late.outcome = Outcome::unexpected;
    late.reason =
        "the reply has a checksum, but the request had none; set checksum: true if the module's "
        "checksum is on";
    return Exchanged{*command, std::move(late)};
  }
  if (places_.IsSetting(command->text)) {
    return Exchanged{*command, DecodeConfirmation(*command, frame, settings)};
  }
  const std::size_t channels = places_.ChannelsOf(command->text, settings_);
  return Exchanged{*command,
                   DecodeReply(*command, PlannedForm(command->text), channels, frame, settings)};
}

bool ReplyReader::IsOfOwnMode(View request, View frame) const {
  if (!settings_.checksum || frame.empty() || !requests_.IsInOtherMode(request)) return false;
  return ChecksumFits(AsText(frame.first(frame.size() - 1)), kChecksum);
}

Answer ReplyReader::ReadingsOf(const Exchanged& exchanged) const {
  const DecodedReply& reply = exchanged.reply;
  Answer answer;
  answer.outcome = reply.outcome;
  answer.reason = reply.reason;
  answer.remedy = reply.remedy;
  for (const std::size_t i : places_.ReadBy(exchanged.command.text)) {
    // If points read one command with different decoders, the decoder of the first point decides
    // how the reply is parsed. Points with another decoder get the quality bad_configuration.
    const bool wrong_form = reply.outcome == Outcome::ok && places_.reads[i]->form != reply.form;
    if (reply.outcome == Outcome::unsupported) {
      answer.readings.push_back({i, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
    } else if (wrong_form) {
      answer.readings.push_back({i, {}, Quality::bad_configuration, {}});
    } else if (reply.outcome == Outcome::ok) {
      Field field = Select(reply, *places_.reads[i]);
      if (auto* number = std::get_if<double>(&field.value)) {
        const auto factor = identification_.FactorOf(i);
        if (factor) *number = (Decimal(*number) * *factor).ToDouble();
        if (!factor) field = BadField({Quality::bad_configuration, Reason::other_module}, {});
      }
      answer.readings.push_back({i, std::move(field.value), field.quality, {}});
    }
  }
  return answer;
}

void ReplyReader::AddLabels(const Exchanged& exchanged, Answer& answer) const {
  const DecodedReply& reply = exchanged.reply;
  if (reply.outcome != Outcome::ok) return;
  const auto points = places_.ReadBy(exchanged.command.text);
  for (const Field& field : reply.fields) {
    const bool used = std::ranges::any_of(points, [&](std::size_t point) {
      const ReadAddress& read = *places_.reads[point];
      const bool all = read.select != ReadAddress::Select::index;
      return read.form == reply.form && (all || read.index == field.channel);
    });
    if (used) continue;
    answer.readings.push_back(
        {kNoPoint, field.value, field.quality, Label(exchanged.command, reply, field)});
  }
}

Answer ReplyReader::Interpret(View request, View frame, bool polled) const {
  const auto exchanged = Read(request, frame);
  if (!exchanged) {
    Answer answer;
    answer.outcome = Outcome::corrupt;
    answer.reason =
        "request '" + Printable(request) + "' is not a DCON request" +
        (settings_.checksum
             ? " with a good checksum; set checksum: false if the module's checksum is off"
             : "");
    return answer;
  }
  Answer answer = ReadingsOf(*exchanged);
  AddLabels(*exchanged, answer);
  const Command& command = exchanged->command;
  if (InputOfQuestion(command.text) || command.text == kAskRestart) {
    return ReadPrinted(command, frame, settings_).value_or(std::move(answer));
  }
  const bool says_nothing = answer.outcome != Outcome::ok || answer.readings.empty();
  if (!says_nothing || PlannedForm(command.text)) return answer;
  // The options of a polled device define how its outputs confirm a write, so ReadPrinted, which
  // accepts the confirmations of all makers, is not tried.
  const bool output = command.text.front() == '#' || command.text.front() == '@';
  if (output && polled) return answer;
  return ReadPrinted(command, frame, settings_).value_or(std::move(answer));
}

namespace {

/// A write to one output of a group repeats the states of the other outputs. States that were read
/// longer ago than this are not used.
constexpr Duration kFresh = 2s;

}  // namespace

WriteJob::WriteJob(const config::Device& device, const Places& places)
    : device_(device), places_(places) {}

std::size_t WriteJob::Together(std::span<const PointValue> writes) const {
  return alone_ ? std::min<std::size_t>(writes.size(), 1) : dcon::Together(places_.outputs, writes);
}

Result<WriteJob::Step> WriteJob::Next(const Task& task, Instant now) {
  if (!task.also.empty()) return NextOfGroup(task, now);
  const config::Point& point = device_.points[task.point];
  const auto& write = places_.writes[task.point];
  if (!write) return Error{"point " + point.name + " cannot be written"};
  const auto command = FormatWrite(*write, task.value);
  if (!command) return Error{"point " + point.name + ": " + command.error()};
  return Step{.command = *command};
}

WriteJob::Step WriteJob::NextOfGroup(const Task& task, Instant now) {
  const OutputGroup& group = places_.outputs[task.point]->group;
  const auto certain = std::exchange(certain_, std::nullopt);
  if (certain && now - certain->at <= kFresh) {
    return {.command = group.command + HexByte(AllOutputs(places_.outputs, task, certain->word))};
  }
  return {.command = group.read, .prepares = true};
}

Answer WriteJob::Take(const Task& task, const Exchanged& exchanged, Answer answer, Instant now) {
  const auto& output = places_.outputs[task.point];
  const bool several = !task.also.empty() && output;
  if (several && exchanged.command.text == output->group.read) {
    return TakeOutputs(task, exchanged, std::move(answer), now);
  }
  answer.may_have_acted = exchanged.reply.may_have_acted;
  if (several && answer.outcome == Outcome::refused && !exchanged.reply.ignored) alone_ = true;
  return answer;
}

/// Uses the output states in a reply only if the last two readings agree, because a damaged reply
/// that looks whole must not switch an output. If they differ, the states are read again.
Answer WriteJob::TakeOutputs(const Task& task, const Exchanged& exchanged, Answer answer,
                             Instant now) {
  if (answer.outcome != Outcome::ok) return answer;
  const auto* word = std::get_if<std::uint64_t>(&exchanged.reply.fields.front().value);
  if (word == nullptr) {  // the states are unknown, so nothing must be written
    answer.outcome = Outcome::unexpected;
    return answer;
  }
  const OutputGroup& group = places_.outputs[task.point]->group;
  const auto before = words_.find(group.read);
  const bool agree =
      before != words_.end() && OutputsIn(group, before->second) == OutputsIn(group, *word);
  if (agree) certain_ = Certain{*word, now};
  words_[group.read] = *word;
  answer.then = Then::ask_again;
  return answer;
}

void WriteJob::OnFailure(const Task& task, bool prepares, bool silent) {
  if (!task.also.empty() && !prepares && silent) alone_ = true;
}

void WriteJob::OnReconnect() {
  words_.clear();
  certain_.reset();
  alone_ = false;
}

bool Sampling::WantsNew(Instant now) const {
  return asked_ == group_.samples || !group_.sampled_at || now - *group_.sampled_at > period_;
}

void Sampling::OnSampled(Instant now) {
  ++group_.samples;
  group_.sampled_at = now;
}

std::optional<std::string> Sampling::WhyNot(bool first) {
  const auto before = std::exchange(fetched_, asked_);
  const bool overtaken = before && asked_ - *before > 1;
  overtaken_ = overtaken ? overtaken_ + 1 : 0;
  if (!first)
    return "the module missed the last sampling broadcast (#**), so its sample is too old";
  if (!before)
    return "the module's sample may be older than the last sampling broadcast (#**), so only the "
           "next sample is used";
  if (overtaken)
    return "the sampling broadcast (#**) was sent several times since the module last answered, so "
           "its reply may contain an old sample";
  return std::nullopt;
}

namespace {

constexpr int MostCounts(Totals::Again why) {
  if (why == Totals::Again::no) return 0;
  return why == Totals::Again::has_moved ? 1 : 2;
}

/// The only query of a module that does not fit its profile. It asks the module's type (`$AA2`)
/// again and reads no points.
const Query kIdentificationQuery{config::Group::slow, {}};

}  // namespace

DconConversation::DconConversation(const config::Device& device, const Settings& settings,
                                   DconBus& bus)
    : device_(device),
      settings_(settings),
      enabled_(settings.enabled),
      group_(bus.Of(settings_.checksum)),
      places_(device, settings_),
      plan_(MakePlan(device, places_)),
      identification_(device, settings_),
      requests_(ParseAddress(device.address).value(), settings_),
      questions_(identification_),
      probing_(settings_, places_.reads, plan_, places_.ChannelsOf("#", settings_)),
      totals_(settings_, places_.reads),
      reader_(settings_, requests_, places_, identification_, !totals_.empty()),
      writes_(device, places_),
      sampling_(group_, device.poll) {}

std::span<const Query> DconConversation::Queries() const {
  if (identification_.trouble()) return {&kIdentificationQuery, 1};
  return plan_.queries();
}

std::string DconConversation::CommandOf(const Task& task) const {
  if (task.kind == Task::Kind::write) return device_.points[task.point].write;
  if (identification_.trouble()) return kAskType;
  return plan_.block(task.query).key.command;
}

Outcome DconConversation::Check(View request, View frame) const {
  const auto exchanged = reader_.Read(request, frame);
  return exchanged ? exchanged->reply.outcome : Outcome::corrupt;
}

Result<Request> DconConversation::Ask(const Task& task, Instant now) {
  questions_.SetAsked(std::nullopt);
  if (std::exchange(withheld_, false)) return Error{trouble().text};
  if (IsHostDue(now)) return requests_.Broadcast(kHostIsThere);
  if (task.kind == Task::Kind::probe) return AskProbe();
  if (task.kind == Task::Kind::poll && questions_.anew()) {
    // The module has answered this type question before, so the question is repeated if no reply
    // comes.
    Request request = AskQuestion(*questions_.anew());
    request.expect.repeatable = true;
    return request;
  }
  const std::string command = CommandOf(task);
  if (const auto question = questions_.Before(command)) return requests_.Question(*question);
  if (!identification_.Allows(command)) {
    return Error{trouble()
                     ? trouble().text
                     : "the module has not reported its checksum mode yet, so nothing was sent"};
  }
  if (task.kind != Task::Kind::write) return AskRead(command, now);
  const auto step = writes_.Next(task, now);
  if (!step) return Error{step.error()};
  Request request = requests_.Own(step->command);
  if (identification_.IsTakenCutShort(request.bytes)) {
    return Error{
        "not sent: the module has not reported its checksum mode, and could take the end of this "
        "command for a checksum; write another value, or set identify: false if its checksum is "
        "off"};
  }
  request.prepares = step->prepares;
  return request;
}

Request DconConversation::AskQuestion(const Identification::Question& question) {
  questions_.SetAsked(question);
  return requests_.Question(question);
}

bool DconConversation::IsHostDue(Instant now) const {
  const Duration period = settings_.host_watchdog;
  return period > Duration::zero() && (!group_.told_at || now - *group_.told_at >= period);
}

/// If the broadcast `~**` is due, sends it before a failed request is repeated, so that the host
/// watchdogs of the modules do not trip meanwhile.
std::optional<Request> DconConversation::Instead(const Request& request, Outcome, Instant now) {
  if (!request.expect.repeatable || !IsHostDue(now)) return std::nullopt;
  return requests_.Broadcast(kHostIsThere);
}

Request DconConversation::AskRead(const std::string& command, Instant now) {
  writes_.OnOther();
  if (totals_.WantsRestart(command) && identification_.Allows(kAskRestart)) {
    return AskQuestion({kAskRestart, false});
  }
  if (command == kAskSample && sampling_.WantsNew(now)) return requests_.Broadcast(kTakeSample);
  return requests_.Own(command);
}

Request DconConversation::AskProbe() {
  writes_.OnOther();
  if (probing_.IsInOtherMode()) return AskQuestion({kAskName, true});
  const std::string command = probing_.Command(identification_);
  Request request = requests_.Own(command);
  request.steady = command == kAskName;
  request.unlike_polls = probing_.IsOwn(command);
  return request;
}

Then DconConversation::OnSent(const Task&, const Request& request, Instant now) {
  if (request.bytes == requests_.Broadcast(kHostIsThere).bytes) {
    group_.told_at = now;
  } else {
    sampling_.OnSampled(now);
  }
  return Then::ask_again;
}

Answer DconConversation::OnFrame(const Task& task, const Request& request, View frame,
                                 Instant now) {
  const auto exchanged = reader_.Read(request.bytes, frame);
  if (!exchanged) return Interpret(request.bytes, frame);
  const bool was_in_trouble = static_cast<bool>(trouble());
  // A failed probe is repeated without a call of Ask, which sets the asked question. So the
  // question in such a probe is set here.
  if (!questions_.asked() && requests_.IsInOtherMode(request.bytes)) {
    questions_.SetAsked(Identification::Question{kAskName, true});
  }
  Answer answer = questions_.asked()               ? TakeQuestion(task, *exchanged, now)
                  : task.kind == Task::Kind::write ? TakeWritten(task, *exchanged, now)
                                                   : TakeRead(task, *exchanged, now);
  if (was_in_trouble != static_cast<bool>(trouble())) answer.then = Then::replan;
  const bool ends = task.kind == Task::Kind::write && answer.then != Then::ask_again;
  if (ends && request.prepares && answer.reason.empty()) {
    answer.reason =
        trouble()
            ? trouble().text
            : "the write was not sent, because the module had to be identified first; write again";
  }
  return answer;
}

Answer DconConversation::TakeQuestion(const Task& task, const Exchanged& exchanged, Instant now) {
  Learn(*questions_.TakeAsked(), exchanged.reply);
  probing_.OnPolled();
  Answer answer;
  if (questions_.anew()) {
    answer.then = questions_.AfterRead(CommandOf(task), now);
  } else if (task.kind != Task::Kind::probe) {
    answer.then = questions_.AfterQuestion(CommandOf(task));
  }
  return answer;
}

Answer DconConversation::TakeWritten(const Task& task, const Exchanged& exchanged, Instant now) {
  Answer answer = writes_.Take(task, exchanged, reader_.ReadingsOf(exchanged), now);
  const std::string& command = exchanged.command.text;
  const bool clears = places_.IsSetting(command) && command.size() == 3 &&
                      (command.starts_with("$6") || command.starts_with("$C"));
  if (answer.outcome == Outcome::ok && clears) totals_.OnCleared("#" + command.substr(2));
  return answer;
}

Answer DconConversation::TakeRead(const Task& task, const Exchanged& exchanged, Instant now) {
  const bool polled = task.kind == Task::Kind::poll;
  const std::string& command = exchanged.command.text;
  Answer answer = reader_.ReadingsOf(exchanged);
  if (command == kAskSample) TakeSample(exchanged, answer);
  if (task.kind == Task::Kind::probe) totals_.Leave(answer);
  const auto again =
      answer.outcome == Outcome::ok ? totals_.Take(command, answer, now) : Totals::Again::no;
  if (ProvesLife(answer.outcome)) {
    LearnModule(task, exchanged, answer);
    LearnPlan(exchanged, answer, now);
  }
  const bool counts_again = polled && counted_again_ < MostCounts(again);
  counted_again_ = counts_again ? counted_again_ + 1 : 0;
  if (answer.then != Then::done || !polled) return answer;
  answer.then = counts_again ? Then::ask_again : questions_.AfterRead(command, now);
  return answer;
}

/// Drops the readings of a sample if they may belong to an older sample than the requested one.
void DconConversation::TakeSample(const Exchanged& exchanged, Answer& answer) {
  sampling_.OnAsked();
  if (answer.outcome != Outcome::ok) return;
  if (const auto why = sampling_.WhyNot(exchanged.reply.first_fetch)) {
    answer.readings.clear();
    answer.reason = *why;
  }
}

void DconConversation::LearnModule(const Task& task, const Exchanged& exchanged,
                                   const Answer& answer) {
  const std::string& command = exchanged.command.text;
  identification_.OnPolled();
  if (exchanged.reply.more_enabled) identification_.AskMaskAgain();
  if (task.kind == Task::Kind::probe) {
    probing_.OnAnswered(command);
  } else {
    probing_.OnPolled();
  }
  const Form form = exchanged.reply.form;
  if (answer.outcome == Outcome::ok && (form == Form::bits || form == Form::status)) {
    const auto* word = std::get_if<std::uint64_t>(&exchanged.reply.fields.front().value);
    if (word != nullptr) writes_.OnWord(command, *word);
  }
  const bool mask = command == kAskMask && form == Form::hex;
  if (settings_.identify && (command == kAskType || mask)) {
    Learn({mask ? kAskMask : kAskType, false}, exchanged.reply);
  }
}

void DconConversation::LearnPlan(const Exchanged& exchanged, Answer& answer, Instant now) {
  // Index of the first query that sends the command; the number of queries if no query sends it.
  std::size_t query = 0;
  while (query < plan_.queries().size() &&
         plan_.block(query).key.command != exchanged.command.text) {
    ++query;
  }
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) change = plan_.OnAnswered(query, now);
  if (answer.outcome == Outcome::unsupported) {
    // A damaged reply can look like a refusal, so points become "not fitted" only after three
    // refusals.
    if (!plan_.IsLastRefusal(query)) answer.readings.clear();
    change = plan_.OnRefused(query, now);
  }
  for (const std::size_t point : plan_.SilentlyRefused(query)) {
    answer.readings.push_back({point, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
  }
  if (change != PlanChange::nothing) answer.then = Then::replan;
}

void DconConversation::Learn(const Identification::Question& question, const DecodedReply& reply) {
  if (question.command == kAskRestart) {
    const auto* flag = reply.outcome == Outcome::ok && !reply.fields.empty()
                           ? std::get_if<std::uint64_t>(&reply.fields.front().value)
                           : nullptr;
    return totals_.OnRestart(flag != nullptr ? std::optional(*flag != 0) : std::nullopt);
  }
  identification_.OnAnswer(question, reply);
  settings_.enabled = identification_.mask().value_or(enabled_);
}

Then DconConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                 Instant now) {
  const bool silent = outcome == Outcome::no_reply;
  const bool behind_read = questions_.ForgetAnew();
  if (const auto question = questions_.TakeAsked()) {
    return OnQuestionFailed(task, *question, outcome, behind_read);
  }
  const bool was_sent = outcome != Outcome::busy;
  if (was_sent && request.bytes == requests_.Own(kAskSample).bytes) sampling_.OnAsked();
  counted_again_ = 0;
  writes_.OnOther();
  if (task.kind == Task::Kind::write) writes_.OnFailure(task, request.prepares, silent);
  if (task.kind == Task::Kind::poll && silent) {
    identification_.OnLost();
    totals_.OnLost();
  }
  if (outcome == Outcome::unexpected) identification_.AskMaskAgain();
  if (task.kind == Task::Kind::probe) {
    return probing_.OnFailed(request.unlike_polls, silent) ? Then::ask_again : Then::done;
  }
  if (task.kind != Task::Kind::poll || !silent) return Then::done;
  return plan_.OnSilent(task.query, now) == PlanChange::nothing ? Then::done : Then::replan;
}

/// Handles a question that got no valid reply. A damaged reply does not count as silence: the next
/// task asks the same question again.
Then DconConversation::OnQuestionFailed(const Task& task, const Identification::Question& question,
                                        Outcome outcome, bool behind_read) {
  const bool silent = outcome == Outcome::no_reply;
  const bool strange = outcome == Outcome::unexpected;
  if (!silent) questions_.ForgetCount();
  if (task.kind == Task::Kind::probe) {
    probing_.OnFailed(false, silent);
    return Then::done;
  }
  if (!silent && !strange) return Then::done;
  if (question.command == kAskRestart) {
    totals_.OnNothing();
  } else {
    identification_.OnNothing(question, strange);
  }
  withheld_ = task.kind == Task::Kind::write && identification_.IsMute();
  if (withheld_) return Then::ask_again;
  return behind_read ? Then::done : questions_.AfterQuestion(CommandOf(task));
}

void DconConversation::OnReconnect() {
  counted_again_ = 0;
  questions_.OnReconnect();
  writes_.OnReconnect();
  sampling_.OnReconnect();
  identification_.OnReconnect();
  totals_.OnReconnect();
  probing_.OnReconnect();
  plan_.OnReconnect();
}

std::string DconConversation::WhatIsLearned() const {
  if (!sampling_.IsOvertaken()) return {};
  return "the samples of this module are replaced by new ones (#**) before the gateway reads them "
         "($4); set the same poll for all modules that are sampled together";
}

}  // namespace baudgate::protocols::dcon
