// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/events.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr std::size_t kSecondDigits = 2;
constexpr std::size_t kMillisecondDigits = 3;
constexpr std::uint32_t kSecondsInMinute = 60;

bool IsLetter(char c) { return c >= 'A' && c <= 'Z'; }

/// "12.345": exactly three decimals, so that a channel may follow without a space.
std::optional<SaidTime> TakeTime(std::string_view& text) {
  std::string_view rest = text;
  const auto seconds = TakeNumber(rest, kSecondDigits);
  if (!seconds || *seconds >= kSecondsInMinute || rest.size() <= kMillisecondDigits) return {};
  const std::string_view decimals = rest.substr(1, kMillisecondDigits);
  if (rest.front() != '.' || !std::ranges::all_of(decimals, IsDigit)) return std::nullopt;
  const auto milliseconds = ParseInteger<std::int64_t>(decimals);
  text = Trim(rest.substr(1 + kMillisecondDigits));
  return SaidTime{std::chrono::seconds(*seconds) + std::chrono::milliseconds(*milliseconds), 1min};
}

DeviceEvent ParseEvent(std::string_view part) {
  DeviceEvent event;
  std::string_view rest = Trim(part);
  event.time = TakeTime(rest);
  if (!rest.empty() && IsDigit(rest.front())) {
    event.channel = TakeNumber(rest, kChannelDigits).value_or(0);
  }
  if (!rest.empty() && rest.front() == 'E') {
    rest.remove_prefix(1);
    const auto code = TakeNumber(rest, kNumberDigits);
    const bool ends = rest.empty() || rest.front() == ' ';
    if (event.time && code && *code > 0 && ends) {
      event.code = *code;
      event.text = std::string(Trim(rest));
      return event;
    }
  }
  event.channel = 0;
  event.text = std::string(Trim(part));
  return event;
}

bool LooksLikeEvent(std::string_view part) {
  const std::string_view text = Trim(part);
  if (text.empty() || !IsDigit(text.front())) return false;
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (IsLetter(text[i]) && IsDigit(text[i + 1])) return true;
  }
  return false;
}

}  // namespace

std::vector<DeviceEvent> ParseEvents(std::string_view data) {
  std::vector<DeviceEvent> events;
  if (Trim(data).empty()) return events;
  for (const std::string_view part : Split(data, '/')) events.push_back(ParseEvent(part));
  return events;
}

bool LooksLikeEvents(std::string_view data) {
  return Trim(data).empty() || std::ranges::all_of(Split(data, '/'), LooksLikeEvent);
}

std::string PrintEvent(const DeviceEvent& event) {
  const Duration time = event.time.value_or(SaidTime{}).time;
  const auto padded = [](std::int64_t number, std::size_t digits) {
    const std::string text = std::to_string(number);
    return std::string(digits - std::min(digits, text.size()), '0') + text;
  };
  return padded(time / 1s % kSecondsInMinute, kSecondDigits) + "." +
         padded(time / 1ms % 1000, kMillisecondDigits) + " " + std::to_string(event.channel) + "E" +
         std::to_string(event.code) + (event.text.empty() ? "" : " " + event.text);
}

}  // namespace baudgate::protocols::spabus
