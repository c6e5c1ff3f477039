// SPDX-License-Identifier: Apache-2.0
#include "tests/support/transcript.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/assembler.h"
#include "tests/support/transcript_script.h"

namespace baudgate {
namespace {

using Piece = TranscriptPiece;
using Step = TranscriptStep;
using Script = TranscriptScript;

/// Handles the reply as a line does, but without a clock.
protocols::Answer Carry(const protocols::Protocol& protocol, protocols::Conversation& conversation,
                        const protocols::Task& task, const protocols::Request& request,
                        const Step& step, Instant now, std::optional<protocols::Request>& instead) {
  if (request.expect.reply == protocols::Expectation::Reply::none) {
    protocols::Answer answer;
    answer.then = conversation.OnSent(task, request, now);
    return answer;
  }
  protocols::Assembler assembler;
  assembler.Begin(protocol.reply_rule, request.expect);
  std::optional<Bytes> frame;
  for (const Piece& piece : step.reply) {
    if (piece.after_silence) frame = assembler.Next(true);
    if (frame) break;
    assembler.Feed(piece.bytes);
    frame = assembler.Next(false);
    if (frame) break;
  }
  if (!frame) frame = assembler.Next(true);
  if (frame) return conversation.OnFrame(task, request, *frame, now);
  protocols::Answer answer;
  answer.outcome = assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame();
  instead = conversation.Instead(request, answer.outcome, now);
  if (!instead) answer.then = conversation.OnFailure(task, request, answer.outcome, now);
  return answer;
}

std::vector<std::string> ValuesOf(const config::Device& device, const protocols::Answer& answer) {
  std::vector<std::string> values;
  for (const protocols::Reading& reading : answer.readings) {
    if (reading.point >= device.points.size()) continue;
    const config::Point& point = device.points[reading.point];
    const bus::Sample sample = bus::ToSample(point, reading);
    const std::string value = HasValue(sample.value) ? ToText(sample.value) + " " : "";
    values.push_back(point.name + " " + value + Name(sample.quality));
  }
  if (!answer.batch) return values;
  if (answer.batch->drained) values.emplace_back("drained");
  if (answer.batch->again) values.emplace_back("again");
  for (const protocols::DeviceEvent& event : answer.batch->events) {
    std::string text = "event " + std::to_string(event.channel) + " " + std::to_string(event.code);
    if (event.time) text += " " + FormatDuration(event.time->time);
    values.push_back(text + (event.text.empty() ? "" : " " + event.text));
  }
  return values;
}

class Player {
 public:
  Player(const protocols::Protocol& protocol, const std::string& path, Script script)
      : protocol_(protocol), path_(path), script_(std::move(script)) {}

  void Play() {
    const auto bus = MakeBus(protocol_);
    const auto conversation = MakeConversation(protocol_, script_.device, bus.get());
    if (script_.device.events) conversation->OnEventsKept({});
    std::size_t query = 0;
    while (next_ < script_.steps.size() && !::testing::Test::HasFailure()) {
      const Step& step = script_.steps[next_];
      if (step.unasked) {
        ++next_;
        PlayUnasked(*conversation, step);
        continue;
      }
      if (step.task) {
        PlayTask(*conversation, *step.task);
        continue;
      }
      const std::size_t count = conversation->Queries().size();
      if (count == 0) return Fail(step, "the conversation asks for nothing");
      const protocols::Then then =
          PlayTask(*conversation, {.kind = protocols::Task::Kind::poll, .query = query % count});
      query = then == protocols::Then::replan || then == protocols::Then::restart ? 0 : query + 1;
    }
  }

 private:
  void Fail(const Step& step, const std::string& message) const {
    ADD_FAILURE_AT(path_.c_str(), step.line) << message;
  }

  protocols::Then PlayTask(protocols::Conversation& conversation, const protocols::Task& task) {
    std::optional<protocols::Request> instead;
    for (int i = 0; i < protocols::kMostSteps; ++i) {
      if (next_ == script_.steps.size() || (i > 0 && script_.steps[next_].task)) {
        Fail(script_.steps[next_ - 1], "what is asked here is not at its end");
        return protocols::Then::done;
      }
      const Step& step = script_.steps[next_++];
      now_ += 1s;
      const auto request = instead ? Result<protocols::Request>(*std::exchange(instead, {}))
                                   : conversation.Ask(task, now_);
      if (!request || !step.request) {
        CheckUnsent(step, request);
        return protocols::Then::done;
      }
      EXPECT_EQ(ToHex(request->bytes), ToHex(*step.request)) << path_ << ":" << step.line;
      const protocols::Answer answer =
          Carry(protocol_, conversation, task, *request, step, now_, instead);
      EXPECT_EQ(Name(answer.outcome), Name(step.outcome))
          << path_ << ":" << step.line << ": " << answer.reason;
      EXPECT_EQ(ValuesOf(script_.device, answer), step.values) << path_ << ":" << step.line;
      if (answer.batch && !answer.batch->events.empty()) {
        conversation.OnEventsKept(answer.batch->said);
      }
      if (!instead && answer.then != protocols::Then::ask_again) return answer.then;
    }
    return protocols::Then::done;
  }

  void PlayUnasked(protocols::Conversation& conversation, const Step& step) {
    const protocols::Standing* const standing = conversation.Listens();
    if (standing == nullptr) return Fail(step, "the device says nothing unasked");
    if (!ear_) {
      ear_.emplace(*standing);
      ear_->Begin(now_);
    }
    std::vector<std::string> values;
    Outcome outcome = Outcome::ok;
    const auto take = [&](const protocols::Answer& answer) {
      if (answer.outcome != Outcome::ok) outcome = answer.outcome;
      for (std::string& value : ValuesOf(script_.device, answer)) values.push_back(value);
    };
    const auto hear = [&](const bus::UnaskedInput& heard) {
      if (heard.damaged > 0) outcome = Outcome::corrupt;
      for (const bus::UnaskedMessage& message : heard.messages) {
        take(conversation.OnUnasked(message.bytes, At(now_ - message.since)));
      }
    };
    const auto wait = [&](Duration time) {
      const Instant until = now_ + time;
      while (true) {
        const Instant heard = ear_->Deadline().value_or(Instant::max());
        const Instant due = conversation.DueAt().value_or(Instant::max());
        if (std::min(heard, due) > until) break;
        now_ = std::max(now_, std::min(heard, due));
        if (heard <= now_) hear(ear_->OnTimer(now_));
        if (due <= now_) take(conversation.OnDue(At(now_)));
      }
      now_ = until;
    };
    wait(1s);
    for (const Piece& piece : step.reply) {
      wait(piece.silence);
      hear(ear_->Feed(piece.bytes, now_));
    }
    wait(standing->idle);
    EXPECT_EQ(Name(outcome), Name(step.outcome)) << path_ << ":" << step.line;
    EXPECT_EQ(values, step.values) << path_ << ":" << step.line;
  }

  static Now At(Instant instant) { return {instant, WallTime(instant.time_since_epoch())}; }

  void CheckUnsent(const Step& step, const Result<protocols::Request>& request) const {
    if (request) return Fail(step, "nothing may be sent, but this is: " + ToHex(request->bytes));
    if (step.request) return Fail(step, request.error());
    EXPECT_EQ(Name(step.outcome), Name(Outcome::unsupported)) << path_ << ":" << step.line;
  }

  const protocols::Protocol& protocol_;
  const std::string& path_;
  Script script_;
  std::size_t next_ = 0;
  Instant now_ = Instant() + 1h;
  std::optional<bus::UnaskedReceiver> ear_;
};

}  // namespace

void PlayTranscript(const protocols::Protocol& protocol, const std::string& path) {
  Script script = ReadTranscript(protocol, path);
  if (script.steps.empty()) ADD_FAILURE_AT(path.c_str(), 1) << "no exchange in it";
  Player(protocol, path, std::move(script)).Play();
}

}  // namespace baudgate
