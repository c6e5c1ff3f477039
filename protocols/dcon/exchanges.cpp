// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/exchanges.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/dcon/rules.h"
#include "protocols/dcon/totals.h"

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

/// A module that does not know the question is silent: the next question comes sooner.
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
    late.reason = "the reply carries a checksum, and none was asked for";
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
  for (std::size_t i = 0; i < places_.reads.size(); ++i) {
    if (!places_.reads[i] || places_.reads[i]->command != exchanged.command.text) continue;
    // Two decoders for one command: that of the first point holds, the other cannot be right.
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

/// What the reply holds and no point reads.
void ReplyReader::AddLabels(const Exchanged& exchanged, Answer& answer) const {
  const DecodedReply& reply = exchanged.reply;
  if (reply.outcome != Outcome::ok) return;
  for (const Field& field : reply.fields) {
    const bool used =
        std::ranges::any_of(places_.reads, [&](const std::optional<ReadAddress>& read) {
          const bool asked =
              read && read->command == exchanged.command.text && read->form == reply.form;
          return asked &&
                 (read->select != ReadAddress::Select::index || read->index == field.channel);
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
    answer.reason = "request '" + Printable(request) + "' is no DCON request" +
                    (settings_.checksum ? " with a good checksum; is checksum: true right?" : "");
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
  // A device that is polled has options that say how its writes are confirmed.
  const bool output = command.text.front() == '#' || command.text.front() == '@';
  if (output && polled) return answer;
  return ReadPrinted(command, frame, settings_).value_or(std::move(answer));
}

namespace {

/// So old may be what is known of outputs that others are written with.
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

/// A damaged reply that looks whole must not move an output: what the outputs are counts when the
/// last two readings agree.
Answer WriteJob::TakeOutputs(const Task& task, const Exchanged& exchanged, Answer answer,
                             Instant now) {
  if (answer.outcome != Outcome::ok) return answer;
  const auto* word = std::get_if<std::uint64_t>(&exchanged.reply.fields.front().value);
  if (word == nullptr) {  // nothing is written
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

}  // namespace baudgate::protocols::dcon
