// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/codec.h"

#include "gateway/base/text.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr std::string_view kNumbered = "IOSVM";
constexpr std::string_view kSingle = "CFTDALB";
constexpr std::size_t kSlaveDigits = 3;

/// Takes a range `first` or `first/last` from the front of `text`. Returns nothing if there is no
/// valid range.
std::optional<Range> TakeRange(std::string_view& text, std::size_t digits) {
  const auto first = TakeNumber(text, digits);
  if (!first) return std::nullopt;
  if (text.empty() || text.front() != '/') return Range{*first, *first};
  text.remove_prefix(1);
  const auto last = TakeNumber(text, digits);
  if (!last || *last < *first) return std::nullopt;
  return Range{*first, *last};
}

/// Parses the part of a command between the type letter and the next colon: channels, category,
/// numbers. Returns false if it is malformed.
bool ParseItems(std::string_view text, Command& command) {
  if (!text.empty() && IsDigit(text.front())) {
    const auto channels = TakeRange(text, kChannelDigits);
    if (!channels) return false;
    command.channels = *channels;
  }
  if (text.empty()) return false;
  command.category = text.front();
  text.remove_prefix(1);
  if (TakesNumber(command.category)) {
    command.numbers = TakeRange(text, kNumberDigits);
    return command.numbers && text.empty();
  }
  return kSingle.find(command.category) != std::string_view::npos && text.empty();
}

std::string RangeText(const Range& range) {
  std::string text = std::to_string(range.first);
  if (range.last != range.first) text += "/" + std::to_string(range.last);
  return text;
}

}  // namespace

bool TakesNumber(char category) { return kNumbered.find(category) != std::string_view::npos; }

std::optional<std::uint32_t> TakeNumber(std::string_view& text, std::size_t most) {
  std::size_t digits = 0;
  while (digits < text.size() && IsDigit(text[digits])) ++digits;
  if (digits == 0 || digits > most) return std::nullopt;
  const auto number = ParseInteger<std::uint32_t>(text.substr(0, digits));
  text.remove_prefix(digits);
  return number;
}

Result<Address> ParseAddress(std::string_view text) {
  const auto wrong = [&](std::string_view why) {
    return Error{"'" + std::string(text) + "' is not an SPA address: " + std::string(why) +
                 "; write [channel]category number, such as I1, 14V1 or F"};
  };
  Address address;
  std::string_view rest = text;
  if (!rest.empty() && IsDigit(rest.front())) {
    const auto channel = TakeNumber(rest, kChannelDigits);
    if (!channel) return wrong("a channel has at most 3 digits");
    address.channel = *channel;
  }
  if (rest.empty()) return wrong("the category letter is missing");
  address.category = rest.front();
  rest.remove_prefix(1);
  if (TakesNumber(address.category)) {
    address.number = TakeNumber(rest, kNumberDigits);
    if (!address.number) return wrong("this category needs a number of 1 to 6 digits");
    if (!rest.empty()) return wrong("there are characters after the number");
    return address;
  }
  if (kSingle.find(address.category) == std::string_view::npos) {
    return wrong("the categories are I O S V M C F T D A, in capital letters");
  }
  if (!rest.empty()) return wrong("categories C, F, T, D and A have no number");
  return address;
}

std::string FormatAddress(const Address& address) {
  std::string text;
  if (address.channel != 0) text += std::to_string(address.channel);
  text += address.category;
  if (address.number) text += std::to_string(*address.number);
  return text;
}

Result<unsigned> ParseSlave(std::string_view text) {
  const auto slave = ParseInteger<unsigned>(text);
  if (!slave || text.size() > kSlaveDigits) {
    return Error{"'" + std::string(text) + "' is not an SPA slave number; write 1 to 899"};
  }
  if (*slave == 0) {
    return Error{"slave number 0 is not used on the SPA Bus; write 1 to 899"};
  }
  if (*slave == kBroadcast) {
    return Error{"900 is the broadcast number, which no device answers; write 1 to 899"};
  }
  return *slave;
}

Command ReadOf(unsigned slave, const Address& first, std::uint32_t last_number) {
  Command command;
  command.slave = slave;
  command.channels = {first.channel, first.channel};
  command.category = first.category;
  if (first.number) command.numbers = Range{*first.number, last_number};
  return command;
}

Command WriteOf(unsigned slave, const Address& address, std::string data) {
  Command command = ReadOf(slave, address, address.number.value_or(0));
  command.write = true;
  command.data = std::move(data);
  return command;
}

Bytes Encode(const Command& command, bool wildcard) {
  std::string text = ">" + std::to_string(command.slave) + (command.write ? "W" : "R");
  // Channel 0 is left out of the text, because single-module relays expect this form.
  if (command.channels != Range{}) text += RangeText(command.channels);
  text += command.category;
  if (command.numbers) text += RangeText(*command.numbers);
  text += ":";
  if (command.write) text += command.data + ":";
  Bytes frame = ToBytes(text);
  const std::string checksum = wildcard ? std::string(kWildcard) : HexByte(Xor8(frame));
  Append(frame, checksum);
  frame.push_back(kCr);
  return frame;
}

ReceivedRequest ParseRequest(View frame) {
  ReceivedRequest request;
  std::string_view text = AsText(frame);
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  if (text.empty() || text.front() != '>') return request;
  std::string_view rest = text.substr(1);
  const auto slave = TakeNumber(rest, kSlaveDigits);
  if (!slave) return request;
  request.slave = *slave;
  if (rest.size() < 3 || rest[rest.size() - 3] != ':') return request;
  const std::string_view checksum = rest.substr(rest.size() - 2);
  const std::uint8_t expected = Xor8(frame.first(text.size() - checksum.size()));
  const auto received = ParseInteger<std::uint8_t>(checksum, 16);
  request.intact = checksum == kWildcard || (received && *received == expected);
  rest.remove_suffix(3);

  Command command;
  command.slave = *slave;
  if (rest.empty() || (rest.front() != 'R' && rest.front() != 'W')) return request;
  command.write = rest.front() == 'W';
  rest.remove_prefix(1);
  if (command.write) {
    const std::size_t colon = rest.find(':');
    if (colon == std::string_view::npos) return request;
    command.data = rest.substr(colon + 1);
    request.data_at = static_cast<std::size_t>(rest.data() - text.data()) + colon + 1;
    rest = rest.substr(0, colon);
    if (command.data.find_first_of("<>:&") != std::string::npos) return request;
  }
  if (ParseItems(rest, command)) request.command = std::move(command);
  return request;
}

}  // namespace baudgate::protocols::spabus
