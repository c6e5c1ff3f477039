// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/write_job.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
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
