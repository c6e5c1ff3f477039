// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/rules.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/reader/codec.h"

namespace baudgate::protocols::reader {
namespace {

/// Shape::tag of the replies to Command::information.
constexpr int kInformation = -2;
/// Shape::tag for a reader that sends tags and answers commands. Bytes between two tags may belong
/// to a reply to a command, so they do not count as damage.
constexpr int kTagsAndAnswers = -1;
constexpr int kNone = 0x100;  // code for "no such character"
// Shape::tag of a text is the code of `start` plus kEnds times the code of `end`.
constexpr int kEnds = 0x200;
constexpr std::size_t kMostInformation = 256;

int CodeOf(std::optional<std::uint8_t> character) { return character ? *character : kNone; }

std::optional<std::uint8_t> OfCode(int code) {
  if (code >= kNone) return std::nullopt;
  return static_cast<std::uint8_t>(code);
}

/// Packs the options of a text into a Shape, because the frame rule gets no Settings: start and end
/// into `tag`, `length` and `most` into the lengths. An expectation without a Shape means that tags
/// come.
Shape ShapeOf(const Settings& settings) {
  return {CodeOf(settings.start) + kEnds * CodeOf(settings.end), settings.length, settings.most};
}

Settings OfShape(const Shape& shape) {
  return {.form = Form::text,
          .start = OfCode(shape.tag % kEnds),
          .end = OfCode(shape.tag / kEnds),
          .length = shape.min_length,
          .most = shape.max_length};
}

}  // namespace

/// Returns which messages can come after `request`. max_bytes exceeds the longest valid text, so
/// that a text that is too long is dropped whole, and its end is not taken for a text.
Expectation Expect(View request, const Settings& settings) {
  if (IsInformation(request)) {
    return {.shapes = {{.tag = kInformation}}, .max_bytes = kMostInformation};
  }
  Expectation expect{.reply = Expectation::Reply::standing, .max_bytes = kTagFrame};
  if (settings.form == Form::text) {
    expect.shapes = {ShapeOf(settings)};
    expect.max_bytes = settings.most + 2 * kMostAround;
  } else if (settings.asks) {
    expect.shapes = {{.tag = kTagsAndAnswers}};
  }
  return expect;
}

namespace {

constexpr std::string_view kTagForm = "\r\n-##########\r\n>";  // # stands for a hex digit
static_assert(kTagForm.size() == kTagFrame);
constexpr std::string_view kBetween = "\r\n>";  // characters that are allowed between two messages

/// Cuts a tag frame. `noise`: the outcome for bytes between two tags.
Cut CutTag(View held, bool idle, Outcome noise) {
  const std::size_t size = std::min(held.size(), kTagFrame);
  std::size_t fits = 0;
  for (; fits < size; ++fits) {
    const char c = static_cast<char>(held[fits]);
    if (kTagForm[fits] == '#' ? !HexDigit(c) : c != kTagForm[fits]) break;
  }
  if (fits == kTagFrame) return Cut::Frame(kTagFrame);
  // Only the '>' at the end is missing: all digits have come.
  if (fits == kTagFrame - 1 && (idle || size > fits)) return Cut::Frame(fits);
  if (fits == size && !idle) return Cut::NeedMore();
  if (fits >= kTagAt) return Cut::Discard(1, Outcome::corrupt, "a damaged tag");
  const bool harmless = cut::IsHarmless(held[0], kBetween);
  return Cut::Discard(1, harmless ? Outcome::none : noise, "noise before a tag");
}

/// Cuts the reply to the information command. It ends with a '>' at the beginning of a line, or,
/// without '>', with a silence behind a whole line.
Cut CutInformation(View held, std::size_t most, bool idle) {
  const auto is_end = [](std::uint8_t byte) { return byte == '\r' || byte == '\n'; };
  const std::size_t size = std::min(held.size(), most);
  bool said = false;
  for (std::size_t at = 0; at < size; ++at) {
    const bool begins = at > 0 && is_end(held[at - 1]);
    if (held[at] == '>' && begins && DecodeInformation(held.first(at))) return Cut::Frame(at + 1);
    if (held[at] == '>' && begins && said) {
      return Cut::Discard(at + 1, Outcome::corrupt, "a damaged answer");
    }
    // The prompt '>' and the echo 'i' of the command are no content of the reply.
    said = said || !cut::IsHarmless(held[at], "\r\n>i");
  }
  if (held.size() >= most) return cut::TooLong();
  if (!idle) return Cut::NeedMore();
  if (!said) return Cut::Discard(held.size(), Outcome::none, "no answer yet");
  if (is_end(held.back()) && DecodeInformation(held)) return Cut::Frame(held.size());
  return cut::Wait(idle, held.size());
}

Cut Checked(View frame, const Settings& form) {
  const View text = TextIn(frame, form);
  const std::size_t around = frame.size() - text.size();
  const bool fits = frame.size() <= form.most + 2 * kMostAround;
  if (!form.start && text.empty() && fits) {
    return Cut::Discard(frame.size(), Outcome::none, "an empty line");
  }
  const bool right = text.size() <= form.most && around <= kMostAround &&
                     (form.length == 0 || text.size() == form.length);
  return right ? Cut::Frame(frame.size())
               : Cut::Discard(frame.size(), Outcome::corrupt,
                              "the text is longer than 'most', has another length than 'length', "
                              "or has too many bytes around it");
}

std::size_t Find(View held, std::uint8_t wanted, std::size_t from) {
  const auto begin = held.begin() + static_cast<std::ptrdiff_t>(from);
  return static_cast<std::size_t>(std::find(begin, held.end(), wanted) - held.begin());
}

Cut CutText(View held, const Settings& form, bool idle) {
  if (form.start && held[0] != *form.start) {
    return cut::SkipNoise(held, std::string(1, static_cast<char>(*form.start)), kBetween);
  }
  if (!form.end) {
    const bool counted = form.start && form.length > 0;
    if (counted && held.size() > form.length) return Checked(held.first(form.length + 1), form);
    if (counted) return cut::Wait(idle, held.size());
    return idle ? Checked(held, form) : Cut::NeedMore();
  }
  const std::size_t end = Find(held, *form.end, form.start ? 1 : 0);
  if (form.start) {
    const std::size_t again = Find(held, *form.start, 1);
    if (std::min(again, end) > form.most + 1) return cut::TooLong();
    if (again < end) return Cut::Discard(again, Outcome::partial, "stopped mid-frame");
  }
  if (end < held.size()) return Checked(held.first(end + 1), form);
  if (idle && !form.start && TextIn(held, form).empty()) return Checked(held, form);
  return cut::Wait(idle, held.size());
}

}  // namespace

Cut RequestRule(View held, const Expectation& expect, bool idle) {
  const std::size_t end = Find(held, '\r', 0);
  if (end >= expect.max_bytes) return cut::TooLong();
  return end < held.size() ? Cut::Frame(end + 1) : cut::Wait(idle);
}

Cut MessageRule(View held, const Expectation& expect, bool idle) {
  if (expect.shapes.empty()) return CutTag(held, idle, Outcome::partial);
  const Shape& shape = expect.shapes.front();
  if (shape.tag == kTagsAndAnswers) return CutTag(held, idle, Outcome::none);
  if (shape.tag == kInformation) return CutInformation(held, expect.max_bytes, idle);
  return CutText(held, OfShape(shape), idle);
}

namespace {

constexpr std::size_t kQuoted = 24;
constexpr std::size_t kShortest = 3;
/// A message that lacks at most this many characters was probably damaged by a bad wire or a full
/// buffer.
constexpr std::size_t kFewLost = 2;
constexpr std::string_view kLineEnds = "\r\n";
constexpr std::string_view kMarks = ":;<=>?@[]!\"#&'()*,";
constexpr std::string_view kUnusual = "{|}~`^\\";

bool IsShown(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

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

/// Returns `heard` with CR LF in place of each line end (CR, LF or CR LF).
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
    return Other(
        std::string("its lines end in a ") + (feed ? "line feed" : "carriage return") +
            " alone, not in CR LF",
        "set the serial server or converter in between to raw mode, or the reader to CR LF");
  }
  const auto shown = std::ranges::count_if(heard, IsShown);
  const bool text = std::ranges::all_of(heard, [](auto byte) {
    return IsShown(byte) || kLineEnds.find(static_cast<char>(byte)) != std::string_view::npos;
  });
  if (!text || shown < static_cast<std::ptrdiff_t>(kShortest)) return std::nullopt;
  return Other("it sends text (" + Quote(heard) + "), but tags are configured",
               "set form: text in the configuration, or use another profile");
}

/// True for text that often comes from a wrong bit rate: it has characters that labels and displays
/// hardly use, or marks without any digit or blank.
bool IsUnusual(View heard) {
  const std::string_view text = AsText(heard);
  const bool marks = text.find_first_of(kMarks) != std::string_view::npos;
  return text.find_first_of(kUnusual) != std::string_view::npos ||
         (marks && text.find_first_of("0123456789 ") == std::string_view::npos);
}

/// Counts the printable characters of a message between its start and end character.
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
                 "set start to the first character that it sends, or look for a converter that "
                 "removes the first byte");
  }
  if (settings.end && std::ranges::all_of(heard, IsShown)) {
    if (IsUnusual(heard)) {
      return Other("the received bytes are not a message" + said,
                   "check bit rate, parity and data bits at the line and at the reader");
    }
    return Other(
        "its messages have no end character" + said,
        "raise idle if messages come in pieces, or set end: \"\" so that silence ends them");
  }
  if (settings.end && !has(*settings.end)) {
    const std::uint8_t last = heard.back();
    const std::string end =
        IsShown(last) ? "end to the last character that it sends" : "end: " + Code(last);
    const bool framed = !settings.start && !IsShown(heard.front());
    return Other("its messages do not end with " + Code(*settings.end) + said,
                 "set " + (framed ? "start: " + Code(heard.front()) + ", " : std::string()) + end);
  }
  const std::size_t size = CharactersOf(heard, settings);
  if (settings.length > 0 && size != settings.length) {
    const bool nearly = size < settings.length && size + kFewLost >= settings.length;
    return Recognised{nearly ? Recognised::What::too_short : Recognised::What::other_setting,
                      "its messages have " + std::to_string(size) + " characters" + said +
                          ", but the option length is " + std::to_string(settings.length),
                      "set length to the number of characters that it sends"};
  }
  if (size <= settings.most) return std::nullopt;
  return Other(
      "its messages have more than " + std::to_string(settings.most) + " characters" + said,
      "raise most in the configuration, or set end to the last character that it sends");
}

}  // namespace

std::optional<Recognised> Recognise(View, View heard, const Settings& settings) {
  const bool text = std::ranges::all_of(heard, [](std::uint8_t byte) { return byte < 0x7F; });
  if (!text || heard.empty()) return std::nullopt;
  return settings.form == Form::tag ? OtherTag(heard, Expect({}, settings))
                                    : OtherText(heard, settings);
}

}  // namespace baudgate::protocols::reader
