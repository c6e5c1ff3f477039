// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/recognise.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/expect.h"
#include "protocols/reader/frame_rule.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {
namespace {

constexpr std::size_t kQuoted = 24;
constexpr std::size_t kShortest = 3;
/// A wire or a buffer takes no more characters out of a message.
constexpr std::size_t kFewLost = 2;
constexpr std::string_view kLineEnds = "\r\n";
constexpr std::string_view kMarks = ":;<=>?@[]!\"#&'()*,";
constexpr std::string_view kUnusual = "{|}~`^\\";

bool IsShown(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

/// The characters for people in it.
std::string Quote(View heard) {
  std::string text;
  for (const std::uint8_t byte : heard) {
    if (IsShown(byte)) text += static_cast<char>(byte);
  }
  const std::string shown(Trim(text));
  return "'" + shown.substr(0, kQuoted) + (shown.size() > kQuoted ? "...'" : "'");
}

bool IsWhole(View held, const Expectation& expect) {
  while (!held.empty()) {
    const Cut cut = MessageRule(held, expect, true);
    if (cut.kind == Cut::Kind::frame) return true;
    held = held.subspan(std::max<std::size_t>(cut.size, 1));
  }
  return false;
}

Recognised Other(std::string cause, std::string remedy) {
  return {Recognised::What::other_setting, std::move(cause), std::move(remedy)};
}

/// Each end of a line as CR LF.
Bytes WithFullEnds(View heard) {
  Bytes full;
  for (std::size_t i = 0; i < heard.size(); ++i) {
    const bool end = heard[i] == '\r' || heard[i] == '\n';
    if (!end) {
      full.push_back(heard[i]);
      continue;
    }
    Append(full, kLineEnds);
    if (heard[i] == '\r' && i + 1 < heard.size() && heard[i + 1] == '\n') ++i;
  }
  return full;
}

std::optional<Recognised> OtherTag(View heard, const Expectation& expect) {
  if (IsWhole(WithFullEnds(heard), expect)) {
    const bool feed = std::ranges::find(heard, '\r') == heard.end();
    return Other(std::string("its lines end in a ") + (feed ? "line feed" : "carriage return") +
                     " alone, not in CR LF",
                 "set what is in between to raw, or the reader to CR LF");
  }
  const auto shown = std::ranges::count_if(heard, IsShown);
  const bool text = std::ranges::all_of(heard, [](auto byte) {
    return IsShown(byte) || kLineEnds.find(static_cast<char>(byte)) != std::string_view::npos;
  });
  if (!text || shown < static_cast<std::ptrdiff_t>(kShortest)) return std::nullopt;
  return Other("it sends text (" + Quote(heard) + "), and tags are configured",
               "set form: text in the configuration, or use another profile");
}

/// Hardly any label or display has such characters, or marks and not one digit or blank; another
/// bit rate makes them of anything.
bool IsUnusual(View heard) {
  const std::string_view text = AsText(heard);
  const bool marks = text.find_first_of(kMarks) != std::string_view::npos;
  return text.find_first_of(kUnusual) != std::string_view::npos ||
         (marks && text.find_first_of("0123456789 ") == std::string_view::npos);
}

/// Between its start and its end.
std::size_t CharactersOf(View heard, const Settings& settings) {
  const auto around = [&](std::optional<std::uint8_t> mark) {
    return mark && IsShown(*mark) && std::ranges::find(heard, *mark) != heard.end() ? 1U : 0U;
  };
  const auto shown = static_cast<std::size_t>(std::ranges::count_if(heard, IsShown));
  return shown - std::min<std::size_t>(shown, around(settings.start) + around(settings.end));
}

std::string Code(std::uint8_t character) { return "0x" + HexByte(character); }

std::optional<Recognised> OtherText(View heard, const Settings& settings) {
  const auto has = [heard](std::uint8_t byte) {
    return std::ranges::find(heard, byte) != heard.end();
  };
  const std::string said = " (" + Quote(heard) + ")";
  if (settings.start && !has(*settings.start)) {
    return Other("its messages do not begin with " + Code(*settings.start) + said,
                 "set start to what it sends; or a converter eats the first byte");
  }
  if (settings.end && std::ranges::all_of(heard, IsShown)) {
    if (IsUnusual(heard)) {
      return Other("bytes come that are no message" + said,
                   "check bit rate, parity and data bits at the line and at the reader");
    }
    return Other("its messages have no end character" + said,
                 "raise idle, if they come in pieces; or set end: \"\", so that silence ends them");
  }
  if (settings.end && !has(*settings.end)) {
    const std::uint8_t last = heard.back();
    const std::string end = IsShown(last) ? "end to what it sends" : "end: " + Code(last);
    const bool framed = !settings.start && !IsShown(heard.front());
    return Other("its messages do not end with " + Code(*settings.end) + said,
                 "set " + (framed ? "start: " + Code(heard.front()) + ", " : std::string()) + end);
  }
  const std::size_t size = CharactersOf(heard, settings);
  if (settings.length > 0 && size != settings.length) {
    const bool nearly = size < settings.length && size + kFewLost >= settings.length;
    return Recognised{nearly ? Recognised::What::too_short : Recognised::What::other_setting,
                      "its messages have " + std::to_string(size) + " characters" + said +
                          ", and length is " + std::to_string(settings.length),
                      "set length to what it sends"};
  }
  if (size <= settings.most) return std::nullopt;
  return Other(
      "its messages have more than " + std::to_string(settings.most) + " characters" + said,
      "raise most in the configuration, or set end to what it sends");
}

}  // namespace

std::optional<Recognised> Recognise(View, View heard, const Settings& settings) {
  const bool text = std::ranges::all_of(heard, [](std::uint8_t byte) { return byte < 0x7F; });
  if (!text || heard.empty()) return std::nullopt;
  return settings.form == Form::tag ? OtherTag(heard, Expect({}, settings))
                                    : OtherText(heard, settings);
}

}  // namespace baudgate::protocols::reader
