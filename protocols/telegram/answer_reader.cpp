// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/answer_reader.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/telegram/reply.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr const char* kNotReady =
    "is what it measures unstable (vibration, draught, load), or is it in a menu?";

AnswerReader::Places PlacesOf(const Description& description, const config::Device& device) {
  AnswerReader::Places places;
  for (const config::Point& point : device.points) {
    auto& place = places.emplace_back();
    if (point.access == config::Access::write) continue;
    auto parsed = ParseRead(point);
    if (parsed && description.Find(parsed->call.telegram)) place = std::move(*parsed);
  }
  return places;
}

std::vector<std::optional<Call>> CallsOf(const AnswerReader::Places& places) {
  std::vector<std::optional<Call>> calls;
  for (const auto& place : places) {
    calls.push_back(place ? std::optional(place->call) : std::nullopt);
  }
  return calls;
}

}  // namespace

AnswerReader::AnswerReader(const Description& description, const Bound& bound,
                           const config::Device& device)
    : description_(description),
      places_(PlacesOf(description, device)),
      questions_(description, bound, CallsOf(places_)) {}

Answer AnswerReader::Read(std::size_t telegram, const Bound& known, const Bound& sent,
                          View frame) const {
  const Reply reply = DecodeReply(description_.telegrams[telegram], frame, known);
  Answer answer{reply.outcome, reply.reason};
  AddReadings(telegram, sent, reply, answer);
  return answer;
}

void AnswerReader::AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                               Answer& answer) const {
  if (reply.outcome == Outcome::busy) answer.remedy = kNotReady;
  if (reply.outcome == Outcome::ok) answer.remedy = reply.remedy;
  const bool refused = reply.outcome == Outcome::unsupported;
  if (reply.outcome != Outcome::ok && !refused) return;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (!questions_.IsAsked(i, telegram, sent)) continue;
    if (refused) {
      answer.readings.push_back({i, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
      continue;
    }
    Decoded decoded = ValueAt(*places_[i], reply);
    answer.readings.push_back({i, std::move(decoded.value), decoded.quality, {}});
  }
}

Outcome AnswerReader::Check(View request, View frame) const {
  const auto sent = description_.Recognise(request);
  if (!sent) return Outcome::corrupt;
  return DecodeReply(description_.telegrams[sent->telegram], frame, sent->values).outcome;
}

Answer AnswerReader::Interpret(View request, View frame) const {
  const auto sent = description_.Recognise(request);
  if (!sent) {
    return {Outcome::corrupt,
            "request '" + Printable(request) + "' is no telegram of the description"};
  }
  const Reply reply = DecodeReply(description_.telegrams[sent->telegram], frame, sent->values);
  Answer answer{reply.outcome, reply.reason};
  AddReadings(sent->telegram, sent->values, reply, answer);
  if (reply.outcome != Outcome::ok) return answer;
  for (const auto& [name, field] : reply.fields) {
    bool shown = false;
    for (std::size_t i = 0; i < places_.size() && !shown; ++i) {
      shown = questions_.IsAsked(i, sent->telegram, sent->values) && places_[i]->field == name;
    }
    if (shown) continue;
    answer.readings.push_back({kNoPoint, field.decoded.value, field.decoded.quality,
                               description_.telegrams[sent->telegram].name + "." + name});
  }
  return answer;
}

Answer AnswerReader::ReadUnasked(View message, const Bound& bound) const {
  Answer why{Outcome::corrupt, "'" + Printable(message) + "' is no telegram of the description"};
  for (std::size_t i = 0; i < description_.telegrams.size(); ++i) {
    if (!description_.telegrams[i].listen) continue;
    Answer answer = Read(i, bound, bound, message);
    if (answer.outcome != Outcome::unexpected) return answer;
  }
  return why;
}

}  // namespace baudgate::protocols::telegram
