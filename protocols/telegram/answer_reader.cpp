// What answers mean for the points: the part of TelegramConversation (conversation.h) that
// remembers nothing.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/telegram/conversation.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr const char* kUnknownCode = "set that at the device, or add it to its codes";
constexpr const char* kNotReady =
    "is what it measures unstable (vibration, draught, load), or is it in a menu?";

}  // namespace

Answer TelegramConversation::AnswerOf(std::size_t telegram, const Bound& sent, View frame) const {
  const Reply reply = DecodeReply(TelegramOf(telegram), frame, sent);
  Answer answer{reply.outcome, reply.reason};
  AddReadings(telegram, sent, reply, answer);
  return answer;
}

void TelegramConversation::AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                                       Answer& answer) const {
  if (reply.outcome == Outcome::busy) answer.remedy = kNotReady;
  if (reply.outcome == Outcome::ok && !reply.reason.empty()) answer.remedy = kUnknownCode;
  const bool refused = reply.outcome == Outcome::unsupported;
  if (reply.outcome != Outcome::ok && !refused) return;
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    if (!reads_[i] || !IsCallOf(reads_[i]->call, TelegramOf(telegram), sent)) continue;
    if (refused) {
      answer.readings.push_back({i, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
      continue;
    }
    Decoded decoded = ValueAt(*reads_[i], reply);
    answer.readings.push_back({i, std::move(decoded.value), decoded.quality, {}});
  }
}

Outcome TelegramConversation::Check(View request, View frame) const {
  const auto sent = settings_.description->Recognise(request);
  if (!sent) return Outcome::corrupt;
  return DecodeReply(TelegramOf(sent->telegram), frame, sent->values).outcome;
}

Answer TelegramConversation::Interpret(View request, View frame) {
  const auto sent = settings_.description->Recognise(request);
  if (!sent) {
    return {Outcome::corrupt,
            "request '" + Printable(request) + "' is no telegram of the description"};
  }
  const Reply reply = DecodeReply(TelegramOf(sent->telegram), frame, sent->values);
  Answer answer{reply.outcome, reply.reason};
  AddReadings(sent->telegram, sent->values, reply, answer);
  if (reply.outcome != Outcome::ok) return answer;
  for (const auto& [name, field] : reply.fields) {
    const bool shown = std::ranges::any_of(reads_, [&, &name = name](const auto& read) {
      return read && read->field == name &&
             IsCallOf(read->call, TelegramOf(sent->telegram), sent->values);
    });
    if (shown) continue;
    answer.readings.push_back({kNoPoint, field.decoded.value, field.decoded.quality,
                               TelegramOf(sent->telegram).name + "." + name});
  }
  return answer;
}

Answer TelegramConversation::OnUnasked(View message, Now) {
  Answer why{Outcome::corrupt, "'" + Printable(message) + "' is no telegram of the description"};
  for (std::size_t i = 0; i < settings_.description->telegrams.size(); ++i) {
    if (!TelegramOf(i).listen) continue;
    Answer answer = AnswerOf(i, bound_, message);
    if (answer.outcome != Outcome::unexpected) return answer;
  }
  return why;
}

}  // namespace baudgate::protocols::telegram
