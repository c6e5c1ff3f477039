// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/listening.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
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
