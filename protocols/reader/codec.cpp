// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/codec.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"

namespace baudgate::protocols::reader {
namespace {

constexpr const char* kForeign =
    "the text has characters that are not ASCII; check parity, data bits and bit rate";

}  // namespace

Bytes EncodeCommand(Command command) { return ToBytes(command == Command::read ? "r\r" : "i\r"); }

bool IsInformation(View request) {
  return AsText(request) == AsText(EncodeCommand(Command::information));
}

Result<std::string> DecodeInformation(View answer) {
  std::string text(AsText(answer));
  std::ranges::replace(text, '\r', '\n');
  std::string lines;
  for (std::string_view line : Split(text, '\n')) {
    if (line.starts_with('>')) line.remove_prefix(1);
    line = Trim(line);
    if (line.empty() || line == "i") continue;
    if (line.front() == '-') return Error{"the answer contains a damaged tag"};
    lines.append(lines.empty() ? "" : " ").append(line);
  }
  if (lines.empty()) return Error{"an empty answer"};
  const auto foreign = [](char c) { return c < ' ' || c > '~'; };
  if (std::ranges::any_of(lines, foreign)) return Error{kForeign};
  return lines;
}

Bytes EncodeTag(std::string_view digits) {
  return ToBytes("\r\n-" + std::string(digits) + "\r\n>");
}

Bytes EncodeText(std::string_view text, const Settings& settings) {
  Bytes frame;
  if (settings.start) frame.push_back(*settings.start);
  Append(frame, text);
  if (settings.end) frame.push_back(*settings.end);
  return frame;
}

View TextIn(View frame, const Settings& settings) {
  if (settings.end && !frame.empty() && frame.back() == *settings.end) {
    frame = frame.first(frame.size() - 1);
  }
  if (settings.start) return frame.subspan(std::min<std::size_t>(frame.size(), 1));
  while (!frame.empty() && cut::IsHarmless(frame.front(), "\r\n")) frame = frame.subspan(1);
  while (!frame.empty() && cut::IsHarmless(frame.back(), "\r\n"))
    frame = frame.first(frame.size() - 1);
  return frame;
}

Result<std::string> Decode(View frame, const Settings& settings) {
  std::string text(AsText(frame));
  if (settings.form == Form::tag) {
    text = text.substr(kTagAt, kTagDigits);
    std::ranges::transform(text, text.begin(), [](char c) { return c >= 'a' ? c - 'a' + 'A' : c; });
    return text;
  }
  text = AsText(TextIn(frame, settings));
  // Control characters are accepted, because some texts contain them, such as GS between the fields
  // of a bar code.
  const auto foreign = [](char c) { return c == 0 || static_cast<unsigned char>(c) >= 0x80; };
  if (std::ranges::any_of(text, foreign)) return Error{kForeign};
  return std::string(Trim(text));
}

Result<int> ParseAddress(std::string_view text) {
  const bool hex = text.starts_with("0x");
  if (text == kNoAddress) return 1;
  const auto number = ParseInteger<int>(hex ? text.substr(2) : text, hex ? 16 : 10);
  if (number && *number >= 1 && *number <= 255) return *number;
  return Error{"'" + std::string(text) +
               "' is not an address; a reader needs no address, so remove the key, or write a "
               "number from 1 to 255"};
}

}  // namespace baudgate::protocols::reader
