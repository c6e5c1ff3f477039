// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/nearly_reply.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/changed_bytes.h"

namespace baudgate::diagnosis {
namespace {

/// The characters that are tried as the missing character of a text.
constexpr std::string_view kCharacters = "0123456789.+-/: ABCDEFGHIJKLMNOPQRSTUVWXYZ";
/// In a longer text no missing character is searched.
constexpr std::size_t kLongestTried = 80;
/// In a longer binary reply no missing byte is searched, because this would take more than some
/// milliseconds.
constexpr std::size_t kLongestBinary = 40;
constexpr std::size_t kCheckDigits = 2;
/// The longest name or address of a device in a reply, in digits.
constexpr std::size_t kMostDigits = 3;
/// In a shorter binary reply no missing bytes are searched.
constexpr std::size_t kShortestReply = 3;
/// This many bytes can follow a whole reply, for example a line end.
constexpr std::size_t kBehind = 3;
/// In a shorter text no missing characters are searched.
constexpr std::size_t kShortestLine = 4;
/// Characters other than digits with which a number, or the rest of a number, can begin.
constexpr std::string_view kSigns = "+-.";
/// Characters of values and check values in a text.
constexpr std::string_view kOfValues = "0123456789ABCDEF.+-/:";

/// True if the bytes begin with a whole reply of more than `least` bytes, by the frame rule of the
/// protocol.
bool StartsWithReply(const Hearing& hearing, View heard, std::size_t least = 0) {
  const protocols::Cut cut = hearing.protocol->reply_rule(heard, *hearing.expect, true);
  return cut.kind == protocols::Cut::Kind::frame && cut.size > least;
}

View WithoutLineEndBefore(View heard) {
  while (!heard.empty() && (heard.front() == '\r' || heard.front() == '\n'))
    heard = heard.subspan(1);
  return heard;
}

bool IsText(const Hearing& hearing, View heard) {
  return std::ranges::all_of(hearing.request, IsPrintable) &&
         std::ranges::all_of(heard, IsPrintable);
}

/// True if only the last byte is missing. All its values are tried.
bool IsWholeWithEnd(const Hearing& hearing, View heard) {
  heard = WithoutLineEndBefore(heard);
  if (heard.empty()) return false;
  // If a line end alone makes any beginning whole, there is no check value, so nothing is proven.
  Bytes shorter(heard.begin(), heard.end());
  shorter.back() = '\r';
  if (StartsWithReply(hearing, shorter)) return false;
  Bytes longer(heard.begin(), heard.end());
  longer.push_back(0);
  for (int last = 0; last < 256; ++last) {
    longer.back() = static_cast<std::uint8_t>(last);
    if (StartsWithReply(hearing, longer)) return true;
  }
  return false;
}

struct LineEnd {
  std::string_view bytes;
  const char* name;
};
constexpr LineEnd kLineEnds[] = {{"\r", "a carriage return"},
                                 {"\n", "a line feed"},
                                 {"\r\n", "CR LF"},
                                 {"\n\r", "a line feed and a carriage return"},
                                 {"\n\n", "two line feeds"}};

/// Recognises a reply that would be whole if it had another line end.
std::optional<Finding> OtherLineEnd(const Hearing& hearing, View heard) {
  std::size_t size = heard.size();
  while (size > 0 && (heard[size - 1] == '\n' || heard[size - 1] == '\r')) --size;
  const std::string_view had = AsText(heard.subspan(size));
  const auto came = std::ranges::find(kLineEnds, had, &LineEnd::bytes);
  if (size == 0 || came == std::end(kLineEnds)) return std::nullopt;
  for (const LineEnd& end : kLineEnds) {
    if (end.bytes == had) continue;
    Bytes changed(heard.begin(), heard.begin() + static_cast<std::ptrdiff_t>(size));
    Append(changed, end.bytes);
    if (!IsWhole(hearing, changed)) continue;
    return Finding{
        .symptom = Symptom::other_setting,
        .cause = std::string("its replies end in ") + came->name + ", not in " + end.name,
        .remedy =
            "correct the line end at the device, or set the converter or serial server in between "
            "to raw"};
  }
  return std::nullopt;
}

/// True if only the carriage return at the end is missing. Test this last: without a check value
/// every beginning of a text is whole with a carriage return.
bool LacksLineEnd(const Hearing& hearing, View heard) {
  if (hearing.outcome != Outcome::partial || heard.size() < kShortestLine) return false;
  const bool ended = std::ranges::any_of(heard, [](auto byte) { return byte == '\r'; });
  if (ended || !IsText(hearing, heard)) return false;
  Bytes longer(heard.begin(), heard.end());
  longer.push_back('\r');
  return StartsWithReply(hearing, longer);
}

bool IsWholeWithoutEighthBit(const Hearing& hearing, View heard) {
  if (hearing.protocol->data_bits > 7) return false;
  Bytes cleared(heard.begin(), heard.end());
  for (std::uint8_t& byte : cleared) byte &= 0x7F;
  return !std::ranges::equal(cleared, heard) && IsWhole(hearing, cleared);
}

/// True if the bytes begin with the punctuation mark with which a reply begins.
bool HasLead(const Hearing& hearing, View heard) {
  if (heard.empty() || std::ispunct(heard.front()) == 0) return false;
  return std::ranges::any_of(hearing.expect->shapes, [&](const protocols::Shape& shape) {
    return shape.tag == heard.front();
  });
}

/// Returns the first byte of the reply, if it is known.
std::optional<std::uint8_t> FirstOf(const Hearing& hearing) {
  // A binary reply begins with the address of the device, as the request does.
  const bool named = !hearing.expect->address.empty() && !hearing.request.empty();
  if (!named || IsText(hearing, hearing.request)) return std::nullopt;
  return hearing.request[0];
}

/// True if the check value of `whole`, a whole reply, proves nothing: if the byte at `other` is
/// changed, some value of the byte at `at` still makes a whole reply.
bool IsWeak(const Hearing& hearing, Bytes whole, std::size_t at, std::size_t other) {
  whole[other] ^= 1;
  for (int byte = 0; byte < 256; ++byte) {
    whole[at] = static_cast<std::uint8_t>(byte);
    if (StartsWithReply(hearing, whole, whole.size() - 1)) return true;
  }
  return false;
}

/// True if `head` and `heard` together are a whole reply, for some value of the byte at `any` in
/// `head`.
bool IsWholeBehind(const Hearing& hearing, Bytes head, std::size_t any, View heard) {
  // A few bytes, such as a line end, can follow the reply.
  const std::size_t least = head.size() + heard.size() - std::min(heard.size(), kBehind);
  Append(head, heard);
  const auto known = any == 0 ? FirstOf(hearing) : std::nullopt;
  for (int byte = known.value_or(0); byte <= known.value_or(0xFF); ++byte) {
    head[any] = static_cast<std::uint8_t>(byte);
    if (!StartsWithReply(hearing, head, least)) continue;
    // The form of a text is proof enough, because it may have no check value.
    return known || IsText(hearing, heard) || !IsWeak(hearing, head, any, head.size() / 2);
  }
  return false;
}

/// Returns the byte that makes the reply whole at `at`. The values from `first` to `last` are
/// tried. Nothing: no value makes the reply whole, or its check value proves nothing.
std::optional<std::uint8_t> OtherAt(const Hearing& hearing, View heard, std::size_t at, int first,
                                    int last) {
  Bytes whole(heard.begin(), heard.end());
  for (int byte = first; byte <= last; ++byte) {
    whole[at] = static_cast<std::uint8_t>(byte);
    if (!StartsWithReply(hearing, whole, whole.size() - 1)) continue;
    if (IsWeak(hearing, whole, at, whole.size() / 2)) return std::nullopt;
    return static_cast<std::uint8_t>(byte);
  }
  return std::nullopt;
}

/// True if only the first byte has another value than it should.
bool IsWholeWithOtherFirst(const Hearing& hearing, View heard) {
  if (hearing.protocol->tcp || heard.size() <= kShortestLine) return false;
  constexpr int kPrintable = 0x7E;
  const auto first = FirstOf(hearing);
  Bytes whole(heard.begin(), heard.end());
  if (first) {
    whole[0] = *first;
    return heard[0] != *first && StartsWithReply(hearing, whole, whole.size() - 1);
  }
  if (!IsText(hearing, heard.subspan(1)) || std::ispunct(heard[0]) != 0) return false;
  return OtherAt(hearing, heard, 0, '!', kPrintable).has_value();
}

/// True if `came` is `sent` without its last bits: a line driver has released the bus too early.
/// The lowest bit of a character is sent first, and all bits after the release are equal. Example:
/// 73 comes as F3 if the highest bit is lost.
bool IsCutShort(std::uint8_t sent, std::uint8_t came) {
  for (unsigned right = 0; right < 8; ++right) {
    const unsigned mask = (1U << right) - 1;
    const unsigned begin = sent & mask;
    if (came == begin || came == (begin | (0xFFU & ~mask))) return true;
  }
  return false;
}

/// Recognises a binary reply of which only the last byte is wrong. (The last byte of a text is its
/// line end.)
std::optional<Finding> OtherLast(const Hearing& hearing, View heard) {
  if (hearing.protocol->tcp || heard.size() <= kShortestLine) return std::nullopt;
  if (IsText(hearing, hearing.request)) return std::nullopt;
  const auto sent = OtherAt(hearing, heard, heard.size() - 1, 0, 0xFF);
  if (!sent) return std::nullopt;
  if (!IsCutShort(*sent, heard.back())) return Finding{.symptom = Symptom::bad_check};
  return Finding{.symptom = Symptom::end_lost, .cause = "garbled"};
}

/// Returns how many bytes are missing at the beginning; 0: no byte is missing. Recognises one byte
/// of any value, or a few bytes that the request contains: the first two or three bytes of a binary
/// reply, or the name and kind at the beginning of a text.
std::size_t LostHead(const Hearing& hearing, View heard) {
  // A Modbus TCP reply contains no check value that could prove the loss.
  if (hearing.protocol->tcp || (IsText(hearing, heard) && HasLead(hearing, heard))) return 0;
  if (IsWholeBehind(hearing, Bytes(1), 0, heard)) return 1;
  const View request = hearing.request;
  for (std::size_t more = 1; more <= kMostDigits && more < request.size(); ++more) {
    Bytes head(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(more + 1));
    if (IsWholeBehind(hearing, head, 0, heard)) return more + 1;
    for (const protocols::Shape& shape : hearing.expect->shapes) {
      head.push_back(static_cast<std::uint8_t>(shape.tag));
      if (IsWholeBehind(hearing, head, 0, heard)) return more + 2;
      head.pop_back();
    }
  }
  if (request.size() < 2) return 0;
  return IsWholeBehind(hearing, {request[0], request[1], 0}, 2, heard) ? 3 : 0;
}

/// Returns a line of text that lacks the first character of a reply, and perhaps more of its
/// beginning than LostHead can prove. Empty: the bytes are something else.
std::string_view LineWithoutLead(const Hearing& hearing, View heard) {
  const bool standing = hearing.expect->reply == protocols::Expectation::Reply::standing;
  if (standing || hearing.request.empty() || !IsText(hearing, heard)) return {};
  heard = WithoutLineEndBefore(heard);
  const std::string_view text = AsText(heard);
  const std::size_t size = text.find_last_not_of("\r\n") + 1;
  if (size < kShortestLine || size == text.size()) return {};
  const bool of_number = kSigns.find(text.front()) != std::string_view::npos;
  if ((std::ispunct(heard.front()) != 0 && !of_number) || HasLead(hearing, heard)) return {};
  return text.substr(0, size);
}

bool IsEndOfText(const Hearing& hearing, View heard) {
  const std::string_view line = LineWithoutLead(hearing, heard);
  const bool values = line.find_first_not_of(kOfValues) == std::string_view::npos;
  return !line.empty() && (values || EndsInCheckValue(hearing, heard));
}

/// True if a text is whole with other digits before its line end, and with only one combination of
/// digits: its check value is wrong. Call before IsWholeWithOneMore, because a check value of one
/// byte fits almost any text with one more character.
bool IsWholeWithOtherCheck(const Hearing& hearing, View heard) {
  heard = WithoutLineEndBefore(heard);
  std::size_t size = heard.size();
  while (size > 0 && (heard[size - 1] == '\n' || heard[size - 1] == '\r')) --size;
  if (!IsText(hearing, heard) || size < 2 * kCheckDigits || size == heard.size()) return false;
  // Messages of a device that sends unasked can follow each other in these bytes.
  const bool several = hearing.expect->reply == protocols::Expectation::Reply::standing;
  Bytes changed(heard.begin(), heard.end());
  int fit = 0;
  for (unsigned value = 0; value < 256; ++value) {
    const std::string digits = HexByte(static_cast<std::uint8_t>(value));
    std::ranges::copy(digits, changed.begin() + static_cast<std::ptrdiff_t>(size - kCheckDigits));
    fit += several ? IsWhole(hearing, changed) : StartsWithReply(hearing, changed);
  }
  return fit == 1;
}

/// True if a text is whole with one more character at some position, and only one character fits
/// there.
bool IsWholeWithOneMore(const Hearing& hearing, View heard) {
  heard = WithoutLineEndBefore(heard);
  if (!IsText(hearing, heard) || heard.size() < 2 || heard.size() > kLongestTried) return false;
  Bytes longer(heard.size() + 1);
  for (std::size_t at = 1; at < heard.size(); ++at) {
    const auto here = static_cast<std::ptrdiff_t>(at);
    std::copy(heard.begin(), heard.begin() + here, longer.begin());
    std::copy(heard.begin() + here, heard.end(), longer.begin() + here + 1);
    int fit = 0;
    for (const char character : kCharacters) {
      longer[at] = static_cast<std::uint8_t>(character);
      fit += StartsWithReply(hearing, longer) ? 1 : 0;
    }
    if (fit == 1) return true;
  }
  return false;
}

/// True if a binary reply is whole with one more byte inside it, as its check value proves. The
/// reply must be one byte shorter than a fixed length of replies.
bool IsWholeWithByteInside(const Hearing& hearing, View heard) {
  if (hearing.protocol->tcp || heard.size() < kShortestReply) return false;
  if (IsText(hearing, hearing.request)) return false;
  const bool one_short =
      std::ranges::any_of(hearing.expect->shapes, [&](const protocols::Shape& shape) {
        return shape.min_length == shape.max_length && shape.max_length == heard.size() + 1;
      });
  if (!one_short || heard.size() > kLongestBinary) return false;
  for (std::size_t at = 1; at < heard.size(); ++at) {
    Bytes longer(heard.begin(), heard.begin() + static_cast<std::ptrdiff_t>(at));
    longer.push_back(0);
    Append(longer, heard.subspan(at));
    for (int byte = 0; byte <= 0xFF; ++byte) {
      longer[at] = static_cast<std::uint8_t>(byte);
      if (StartsWithReply(hearing, longer, heard.size())) {
        return !IsWeak(hearing, longer, at, at == 1 ? 2 : 1);
      }
    }
  }
  return false;
}

/// True if only the check value is missing, in a binary protocol that has one.
bool LacksCheck(const Hearing& hearing, View heard) {
  const protocols::PduCarrier* const carrier = hearing.protocol->carrier;
  if (carrier == nullptr || hearing.protocol->tcp || heard.size() < kShortestReply) return false;
  if (std::ranges::all_of(hearing.request, IsPrintable)) return false;
  const Bytes whole = carrier->wrap(heard[0], heard.subspan(1));
  const std::size_t check = whole.size() - heard.size();
  const std::size_t rest = heard.size() - std::min(heard.size(), check);
  const bool has_one =
      rest > 1 && std::ranges::equal(carrier->wrap(heard[0], heard.subspan(1, rest - 1)), heard);
  if (has_one) return false;
  // If only the second byte of the check value were missing, the frame would be one byte shorter
  // than `whole`.
  const protocols::Cut cut = hearing.protocol->reply_rule(whole, *hearing.expect, true);
  return cut.kind == protocols::Cut::Kind::frame && cut.size == whole.size();
}

/// True if only the first byte of the frame is missing, as its check value proves.
bool LacksLead(const Hearing& hearing, View heard) {
  if (hearing.protocol->carrier == nullptr || hearing.request.empty() || heard.empty())
    return false;
  Bytes whole = {hearing.request.front()};
  Append(whole, heard);
  return StartsWithReply(hearing, whole, heard.size() - 1);
}

/// True if only CR LF at the end is missing, as the check value proves.
bool LacksCrLf(const Hearing& hearing, View heard) {
  if (!IsText(hearing, heard) || heard.size() < kShortestLine) return false;
  Bytes longer(heard.begin(), heard.end());
  Append(longer, std::string_view("\r\n"));
  if (!StartsWithReply(hearing, longer, heard.size() + 1)) return false;
  Bytes shorter(heard.begin(), heard.end() - 1);
  Append(shorter, std::string_view("\r\n"));
  return !StartsWithReply(hearing, shorter);
}

}  // namespace

bool EndsInCheckValue(const Hearing& hearing, View heard) {
  const std::string_view line = LineWithoutLead(hearing, heard);
  if (line.empty()) return false;
  const std::string_view check = line.substr(line.size() - kCheckDigits);
  return line[line.size() - kCheckDigits - 1] == ':' &&
         check.find_first_not_of(kOfValues) == std::string_view::npos;
}

bool LacksFirstByte(const Hearing& hearing, View heard) {
  if (hearing.protocol->tcp) return false;
  if (std::ranges::all_of(hearing.request, IsPrintable)) return LacksLead(hearing, heard);
  return IsWholeBehind(hearing, Bytes(1), 0, heard);
}

std::optional<Finding> TooShort(const Hearing& hearing, View heard) {
  if (!LacksCheck(hearing, heard)) return std::nullopt;
  if (auto changed = ChangedBytes(hearing, heard)) return changed;
  return Finding{
      .symptom = Symptom::tail_lost,
      .cause = "its check value",
      .remedy = "the device or a converter does not keep to its protocol: update its firmware"};
}

std::optional<Finding> NearlyReply(const Hearing& hearing, View heard) {
  if (IsWholeWithoutEighthBit(hearing, heard)) {
    const bool mark = std::ranges::all_of(heard, [](auto byte) { return byte > 0x7F; });
    return Finding{.symptom = Symptom::eighth_bit, .cause = mark ? "mark" : ""};
  }
  if (auto other = OtherLineEnd(hearing, heard)) return other;
  if (auto changed = ChangedBytes(hearing, heard)) return changed;
  if (IsWholeWithOtherFirst(hearing, heard)) {
    return Finding{.symptom = Symptom::head_lost, .cause = "garbled"};
  }
  if (const std::size_t lost = LostHead(hearing, heard); lost > 0) {
    return Finding{.symptom = Symptom::head_lost, .cause = lost > 1 ? "a few" : ""};
  }
  if (IsEndOfText(hearing, heard)) return Finding{.symptom = Symptom::head_lost, .cause = "a few"};
  if (LacksCrLf(hearing, heard)) {
    return Finding{.symptom = Symptom::tail_lost, .cause = "its line end"};
  }
  if (IsWholeWithEnd(hearing, heard)) return Finding{.symptom = Symptom::end_lost};
  if (auto other = OtherLast(hearing, heard)) return other;
  if (IsWholeWithOtherCheck(hearing, heard)) {
    return Finding{.symptom = Symptom::bad_check, .cause = "a text"};
  }
  if (IsWholeWithOneMore(hearing, heard) || IsWholeWithByteInside(hearing, heard)) {
    return Finding{.symptom = Symptom::bytes_lost};
  }
  if (LacksLineEnd(hearing, heard)) {
    return Finding{.symptom = Symptom::tail_lost, .cause = "its line end"};
  }
  return std::nullopt;
}

namespace {

constexpr std::size_t kQuotedBytes = 8;
/// A modem, radio or serial server adds at most this many bytes around a packet.
constexpr std::size_t kLongestFrame = 24;
/// This many bytes of another form than IsOfDriver describes do not come from a bus driver.
constexpr std::ptrdiff_t kFewStrange = 2;

Symptom SymptomOf(protocols::Recognised::What what) {
  switch (what) {
    case protocols::Recognised::What::other_device:
      return Symptom::other_device;
    case protocols::Recognised::What::other_master:
      return Symptom::other_master;
    case protocols::Recognised::What::other_reply:
      return Symptom::other_reply;
    case protocols::Recognised::What::other_setting:
      return Symptom::other_setting;
    case protocols::Recognised::What::other_form:
      return Symptom::other_form;
    case protocols::Recognised::What::other_check:
      return Symptom::bad_check;
    case protocols::Recognised::What::too_short:
      return Symptom::bytes_lost;
    case protocols::Recognised::What::other_protocol:
      break;
  }
  return Symptom::other_protocol;
}

/// True if a driver that starts or stops driving the bus can cause this byte: its bits are ones and
/// then zeros, or the reverse.
bool IsOfDriver(std::uint8_t byte) {
  const unsigned inverse = static_cast<std::uint8_t>(~byte);
  return (byte & (byte + 1U)) == 0 || (inverse & (inverse + 1U)) == 0;
}

/// True for line ends, and for 00 and FF, which come from a line without bias.
bool IsFiller(View bytes) {
  return std::ranges::all_of(bytes, [](auto byte) { return byte % 0xFF == 0 || IsLineEnd(byte); });
}

/// Returns the bytes around a reply, such as "10 02 ... 10 03". Empty: there are more than the
/// frame of a packet has.
std::string Around(View before, View behind) {
  if (before.size() + behind.size() > kLongestFrame) return {};
  while (!before.empty() && IsLineEnd(before.back())) before = before.first(before.size() - 1);
  while (!behind.empty() && IsLineEnd(behind.front())) behind = behind.subspan(1);
  const View text = before.empty() ? behind : before;
  const bool words = text.size() > 1 && std::ranges::all_of(text, IsPrintable);
  if (words && (before.empty() || behind.empty())) {
    return (before.empty() ? "... " : "") + Quote(text) + (before.empty() ? "" : " ...");
  }
  const std::string front = ToHex(before.first(std::min(before.size(), kQuotedBytes)));
  const std::string back = ToHex(behind.first(std::min(behind.size(), kQuotedBytes)));
  return front + (front.empty() ? "... " : " ...") + (back.empty() || front.empty() ? "" : " ") +
         back;
}

}  // namespace

std::optional<Finding> Recognise(const Hearing& hearing, View heard) {
  if (hearing.protocol->recognise == nullptr) return std::nullopt;
  auto recognised = hearing.protocol->recognise(hearing.request, heard, *hearing.options);
  if (!recognised) return std::nullopt;
  return Finding{.symptom = SymptomOf(recognised->what),
                 .cause = std::move(recognised->cause),
                 .remedy = std::move(recognised->remedy)};
}

bool IsHexText(const Hearing& hearing, View part) {
  const auto is_digit = [](std::uint8_t byte) {
    return std::isxdigit(byte) != 0 || IsLineEnd(byte);
  };
  return hearing.protocol->carrier != nullptr && !hearing.protocol->tcp &&
         std::ranges::all_of(hearing.request, IsPrintable) && std::ranges::all_of(part, is_digit);
}

std::optional<Finding> Stranger(const Hearing& hearing, View part) {
  if (part.size() <= kHarmless) return std::nullopt;
  auto recognised = Recognise(hearing, part);
  if (recognised && recognised->symptom == Symptom::other_master) {
    recognised->symptom = Symptom::master_beside;
    return recognised;
  }
  if (recognised && recognised->symptom == Symptom::other_device) {
    recognised->symptom = Symptom::device_beside;
    return recognised;
  }
  if (auto foreign = OtherFrame(hearing, part)) {
    foreign->symptom = Symptom::master_beside;
    return foreign;
  }
  // If replies consist of hexadecimal digits, `part` is the rest of a reply and no text.
  if (IsHexText(hearing, part)) return std::nullopt;
  auto words = Words(hearing, part, true);
  if (words) words->symptom = Symptom::text_beside;
  return words;
}

Finding StrayBeside(const Hearing& hearing, View before, View behind) {
  const auto noise = [&](Symptom symptom) {
    return Finding{.symptom = symptom,
                   .bytes = before.size() + behind.size(),
                   .cause = Around(before, behind)};
  };
  // Bytes that no bus driver causes come from another device, which sends while the bus should be
  // idle.
  const auto strange = std::ranges::count_if(
      before, [](std::uint8_t byte) { return !IsOfDriver(byte) && !IsLineEnd(byte); });
  const bool speaks = !hearing.connection && strange >= kFewStrange;
  if (before.size() > kHarmless || speaks) return noise(Symptom::noise_before);
  // On a TCP connection no driver can cause bytes after the reply.
  if (hearing.protocol->tcp && !behind.empty()) return noise(Symptom::noise_behind);
  if (behind.size() > kHarmless) return noise(Symptom::noise_behind);
  // On a wire a driver can cause one byte, or more bytes of 00 and FF.
  const std::size_t few = hearing.connection ? 1 : 2;
  const bool form = !IsFiller(before) || !IsFiller(behind);
  return form && before.size() + behind.size() >= few ? noise(Symptom::few_beside) : Finding{};
}

}  // namespace baudgate::diagnosis
