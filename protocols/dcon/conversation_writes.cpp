// Writes: the part of DconConversation (conversation.h) that sends them, and takes what the module
// says.
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "gateway/base/text.h"
#include "protocols/dcon/conversation.h"

namespace baudgate::protocols::dcon {
namespace {

/// So old may be what is known of outputs that others are written with.
constexpr Duration kFresh = 2s;

}  // namespace

Result<Request> DconConversation::AskWrite(const Task& task, Instant now) {
  if (!task.also.empty()) return AskGroup(task, now);
  const config::Point& point = device_.points[task.point];
  const auto& write = writes_[task.point];
  if (!write) return Error{"point " + point.name + " cannot be written"};
  const auto command = FormatWrite(*write, task.value);
  if (!command) return Error{"point " + point.name + ": " + command.error()};
  return MakeRequest(*command);
}

std::size_t DconConversation::WritesTogether(std::span<const PointValue> writes) const {
  return alone_ ? Conversation::WritesTogether(writes) : Together(outputs_, writes);
}

/// What the others are is read first.
Request DconConversation::AskGroup(const Task& task, Instant now) {
  const OutputGroup& group = outputs_[task.point]->group;
  const auto certain = std::exchange(certain_, std::nullopt);
  if (certain && now - certain->at <= kFresh) {
    return MakeRequest(group.command + HexByte(AllOutputs(outputs_, task, certain->word)));
  }
  Request request = MakeRequest(group.read);
  request.prepares = true;
  return request;
}

Answer DconConversation::OnWritten(const Task& task, const Exchanged& exchanged, Instant now) {
  const std::string& command = exchanged.command.text;
  const bool several = !task.also.empty() && outputs_[task.point];
  const bool reads = several && command == outputs_[task.point]->group.read;
  if (reads) return OnOutputs(task, exchanged, now);
  Answer answer = ReadingsOf(exchanged);
  answer.may_have_acted = exchanged.reply.may_have_acted;
  if (several && answer.outcome == Outcome::refused && !exchanged.reply.ignored) alone_ = true;
  const bool clears = IsSetting(command) && command.size() == 3 &&
                      (command.starts_with("$6") || command.starts_with("$C"));
  if (answer.outcome == Outcome::ok && clears) totals_->OnCleared("#" + command.substr(2));
  return answer;
}

/// A damaged reply that looks whole must not move an output: what they are counts when the last
/// two readings agree.
Answer DconConversation::OnOutputs(const Task& task, const Exchanged& exchanged, Instant now) {
  Answer answer = ReadingsOf(exchanged);
  if (answer.outcome != Outcome::ok) return answer;
  const auto* word = std::get_if<std::uint64_t>(&exchanged.reply.fields.front().value);
  if (word == nullptr) {  // nothing is written
    answer.outcome = Outcome::unexpected;
    return answer;
  }
  const OutputGroup& group = outputs_[task.point]->group;
  const auto before = words_.find(group.read);
  const bool agree =
      before != words_.end() && OutputsIn(group, before->second) == OutputsIn(group, *word);
  if (agree) certain_ = Certain{*word, now};
  words_[group.read] = *word;
  answer.then = Then::ask_again;
  return answer;
}

}  // namespace baudgate::protocols::dcon
