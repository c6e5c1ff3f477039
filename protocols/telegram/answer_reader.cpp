// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/answer_reader.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

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

namespace {

constexpr std::size_t kMostOthers = 3;
constexpr std::size_t kLongestBegin = 10;
constexpr std::size_t kShortestWord = 2;

/// The word in its fixed characters by which people know it, "MDA"; else its name.
std::string WordOf(const Telegram& telegram) {
  for (const Element& element : telegram.receive.front().pattern.elements) {
    std::string word;
    for (const std::uint8_t byte : element.literal) {
      if (std::isalnum(byte) != 0) word += static_cast<char>(byte);
    }
    if (word.size() >= kShortestWord) return word;
  }
  return telegram.name;
}

/// "$GPGSV".
std::string BeginOf(View message) {
  const std::string_view text = Trim(AsText(message));
  return Printable(ToBytes(text.substr(0, std::min(text.find_first_of(", "), kLongestBegin))));
}

std::string Joined(const std::vector<std::string>& words, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += i == 0 ? "" : i + 1 == words.size() ? last : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace

Listening::Listening(const Description& description, const Bound& bound,
                     const AnswerReader::Places& places)
    : description_(description), bound_(bound) {
  for (std::size_t i = 0; i < description.telegrams.size(); ++i) {
    const Telegram& telegram = description.telegrams[i];
    const bool read = std::ranges::any_of(
        places, [&](const auto& place) { return place && place->call.telegram == telegram.name; });
    if (telegram.listen && read && !telegram.receive.empty()) awaited_.push_back({i, false, {}});
  }
}

/// It is this telegram, whatever its parameters say.
bool Listening::Take(Awaited& awaited, View message) const {
  for (const Form& form : description_.telegrams[awaited.telegram].receive) {
    const Match match = MatchAll(form, message, bound_);
    if (match.kind != Match::Kind::whole) continue;
    awaited.came = awaited.came || !match.other;
    if (!match.other) return true;
    for (const auto& [name, value] : ValuesOf(form, match)) {
      const auto bound = bound_.find(name);
      if (bound == bound_.end() || SameValue(value, bound->second)) continue;
      awaited.said = name + ": " + ToText(value);
    }
    return true;
  }
  return false;
}

void Listening::OnMessage(View message) {
  bool taken = false;
  for (Awaited& awaited : awaited_) taken = Take(awaited, message) || taken;
  if (taken || others_.size() >= kMostOthers) return;
  std::string begin = "'" + BeginOf(message) + "'";
  if (std::ranges::find(others_, begin) == others_.end()) others_.push_back(std::move(begin));
}

std::string Listening::Missing() const {
  std::vector<std::string> missing;
  for (const Awaited& awaited : awaited_) {
    if (awaited.came) continue;
    const std::string word = WordOf(description_.telegrams[awaited.telegram]);
    if (!awaited.said.empty()) {
      return word + " comes with another unit than is awaited (" + awaited.said +
             "): set parameters: { " + awaited.said + " }";
    }
    missing.push_back(word);
  }
  if (missing.empty()) return {};
  const std::string none = "no " + Joined(missing, " and no ") + " comes";
  if (missing.size() < awaited_.size() || others_.empty()) {
    return none + ": switch it on at the device, or take these points out of the profile";
  }
  return none + ", but " + Joined(others_, " and ") +
         ": is another device at this port, or are these switched off in it?";
}

}  // namespace baudgate::protocols::telegram
