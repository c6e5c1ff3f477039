// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/reply_reader.h"

#include <algorithm>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/dcon/channel_types.h"
#include "protocols/dcon/printed.h"
#include "protocols/dcon/totals.h"

namespace baudgate::protocols::dcon {
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

}  // namespace baudgate::protocols::dcon
