// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/examine.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <functional>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/diagnosis/damage/changed_bytes.h"
#include "gateway/diagnosis/damage/nearly_reply.h"
#include "protocols/assembler.h"

namespace baudgate::diagnosis {
namespace {

/// Readable text has at least kShortestText printable characters, or is a word of at least
/// kShortestWord letters.
constexpr std::size_t kShortestText = 6;
constexpr std::size_t kShortestWord = 5;
/// A line of this many printable characters counts as readable text, whatever it contains.
constexpr std::size_t kLine = 8;
constexpr std::size_t kQuoted = 30;
/// This many lines that begin alike (kAlike characters) in one exchange were sent unasked.
constexpr std::ptrdiff_t kRepeated = 2;
constexpr std::size_t kAlike = 2;
constexpr std::string_view kLogins[] = {"login:", "username:", "password:", "logon:"};

/// Texts with which a serial server reports that its port is in use.
constexpr std::string_view kInUse[] = {"in use", "busy", "too many", "occupied", "limit"};

bool IsLetter(std::uint8_t byte) {
  return (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z');
}

bool IsModem(View heard) {
  constexpr std::string_view kWords[] = {"OK",   "ERROR",   "NO CARRIER", "BUSY",
                                         "RING", "CONNECT", "NO ANSWER",  "NO DIALTONE"};
  const std::string_view text = Trim(AsText(heard));
  return std::ranges::any_of(kWords, [&](std::string_view word) { return text.starts_with(word); });
}

/// True for readable text. In a binary protocol a few letters are enough; where replies are text,
/// more letters are required.
bool IsWords(const Hearing& hearing, View heard) {
  while (!heard.empty() && IsLineEnd(heard.back())) heard = heard.first(heard.size() - 1);
  const auto printable = std::ranges::count_if(heard, IsPrintable);
  const auto letters = std::ranges::count_if(heard, IsLetter);
  const auto size = static_cast<std::ptrdiff_t>(heard.size());
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (binary && letters == size && heard.size() >= kShortestWord) return true;
  // A packet of a radio or serial server, such as "HB0001" or a telephone number.
  const bool name = std::ranges::all_of(heard, [](auto byte) { return std::isalnum(byte) != 0; });
  if (binary && name && heard.size() >= kShortestText) return true;
  if (heard.size() < kShortestText || 20 * printable < 19 * size) return false;
  return binary ? letters >= 3 : 5 * letters >= 2 * size;
}

/// True if several lines begin alike. Empty lines, such as those before a login prompt, are
/// ignored.
bool Repeats(View heard) {
  View first;
  std::ptrdiff_t alike = 0;
  for (auto at = std::ranges::find_if_not(heard, IsLineEnd); at != heard.end();) {
    const auto end = std::find_if(at, heard.end(), IsLineEnd);
    const View line(at, end);
    const View front = line.first(std::min(line.size(), kAlike));
    if (first.empty()) first = front;
    alike += std::ranges::equal(front, first) ? 1 : 0;
    at = std::find_if_not(end, heard.end(), IsLineEnd);
  }
  return alike >= kRepeated;
}

bool Has(View heard, std::span<const std::string_view> words) {
  std::string text(AsText(heard));
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::ranges::any_of(
      words, [&](std::string_view word) { return text.find(word) != std::string::npos; });
}

constexpr std::string_view kHungUp[] = {"no carrier", "no answer", "no dialtone"};

std::string RemedyFor(View heard) {
  if (IsModem(heard) && Has(heard, kHungUp)) {
    return "the modem has no connection: dial again, and check the modem and its line";
  }
  if (Has(heard, kLogins)) {
    return "switch the console (getty) that asks for a login off at the other end, or check the "
           "port";
  }
  if (Repeats(heard)) {
    return "it sends unasked: switch its automatic (continuous) output off";
  }
  return Has(heard, kInUse)
             ? "end the other client of the server, or raise its limit of connections"
             : "";
}

Finding Text(const Hearing& hearing, View heard) {
  // Text that comes after a password was sent may repeat the password, so it is not quoted.
  const bool secret = !hearing.expect->secrets.empty();
  return {.symptom = Symptom::text,
          .bytes = heard.size(),
          .cause = secret           ? std::string("not shown, as a password was sent before")
                   : IsModem(heard) ? Quote(ToBytes(Trim(AsText(heard))))
                                    : Quote(heard),
          .remedy = RemedyFor(heard)};
}

/// True for a complete line of printable characters of at least kLine bytes, or twice as many in a
/// text protocol.
bool IsLine(const Hearing& hearing, View heard) {
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (heard.size() < (binary ? kLine : 2 * kLine)) return false;
  return IsLineEnd(heard.back()) && std::ranges::all_of(heard, IsPrintable);
}

/// True if one of the first three bytes is a byte with which a reply begins.
bool BeginsLikeReply(const Hearing& hearing, View heard) {
  const protocols::Expectation& expect = *hearing.expect;
  return std::ranges::any_of(heard.first(std::min<std::size_t>(heard.size(), 3)), [&](auto byte) {
    const bool address = !expect.address.empty() && byte == expect.address[0];
    const bool lead = !hearing.request.empty() && byte == hearing.request.front();
    return address || lead ||
           std::ranges::any_of(expect.shapes, [byte](const protocols::Shape& shape) {
             return shape.tag > 0 && (shape.tag & 0xFF) == byte;
           });
  });
}

/// Recognises text that ends with a prompt for a user or a password. Other text can come before it.
std::optional<Finding> LoginPrompt(const Hearing& hearing, View heard) {
  const std::string_view text = Trim(AsText(heard));
  const std::string_view line = text.substr(text.find_last_of("\r\n") + 1);
  const bool asks = line.ends_with(':') && Has(ToBytes(line), kLogins);
  if (!asks || !std::ranges::all_of(heard, IsPrintable)) return std::nullopt;
  return Text(hearing, heard);
}

}  // namespace

std::string Quote(View text) {
  std::string quoted = Printable(text.first(std::min(text.size(), kQuoted)));
  if (text.size() > kQuoted) quoted += "...";
  return "'" + quoted + "'";
}

std::optional<Finding> Words(const Hearing& hearing, View heard, bool lines) {
  const bool likely = IsWords(hearing, heard) || (lines && IsLine(hearing, heard));
  if (!IsModem(heard) && (!likely || BeginsLikeReply(hearing, heard))) return std::nullopt;
  return Text(hearing, heard);
}

std::optional<Finding> OtherFrame(const Hearing& hearing, View heard) {
  // In a binary protocol a correct check value proves nothing, because other protocols use the
  // same.
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (binary && !std::ranges::all_of(heard, IsPrintable)) return std::nullopt;
  for (const protocols::ForeignRule foreign : hearing.foreign) {
    if (foreign == hearing.protocol->foreign) continue;
    auto cause = foreign(heard);
    if (!cause) continue;
    return Finding{.symptom = Symptom::other_master,
                   .bytes = heard.size(),
                   .cause = std::move(*cause),
                   .remedy =
                       "another master and its devices are on this line: use a separate line for "
                       "each protocol"};
  }
  return std::nullopt;
}

namespace {

constexpr const char* kPortNumber = "check the host and the port number of the line";
constexpr const char* kNoTelnet = "set its port to raw TCP, without Telnet or RFC 2217";

struct Service {
  std::string_view begins;
  const char* cause;
};
constexpr Service kServices[] = {
    {"HTTP/", "a web server answers"},         {"<!DOCTYPE", "a web server answers"},
    {"<html", "a web server answers"},         {"SSH-", "an SSH server answers"},
    {"RTSP/", "a camera answers (RTSP)"},      {"220 ", "a mail or file server answers"},
    {"220-", "a mail or file server answers"}, {"* OK ", "a mail server answers"},
    {"+OK ", "a mail server answers"},         {"-ERR ", "a database or mail server answers"},
    {"AMQP", "a message broker answers"},      {"RFB 0", "a remote desktop answers (VNC)"},
    {"ACKF", "an OPC UA server answers"},      {"ERRF", "an OPC UA server answers"},
    {"FINS", "a FINS server answers (Omron)"},
};

bool IsTls(View heard) {
  return heard.size() >= 5 && (heard[0] == 0x15 || heard[0] == 0x16) && heard[1] == 3 &&
         heard[2] <= 4;
}

/// True for IEC 60870-5-104: STARTDT, STOPDT or TESTFR (activation or confirmation), or an
/// acknowledgement.
bool IsIec104(View heard) {
  if (heard.size() < 6 || heard[0] != 0x68 || heard[1] != 4) return false;
  const bool unnumbered = (heard[2] & 3) == 3 && heard[3] == 0 && heard[4] == 0 && heard[5] == 0;
  return unnumbered || (heard[2] == 1 && heard[3] == 0);
}

/// True for a whole packet of ISO on TCP: connection confirm, disconnect or data.
bool IsIsoOnTcp(View heard) {
  if (heard.size() < 7 || heard[0] != 3 || heard[1] != 0) return false;
  const std::size_t size = heard[2] * 256U + heard[3];
  return size == heard.size() && (heard[5] == 0xD0 || heard[5] == 0xF0 || heard[5] == 0x80);
}

bool IsDnp3(View heard) {
  return heard.size() >= 10 && heard[0] == 0x05 && heard[1] == 0x64 && heard[2] >= 5;
}

struct BinaryService {
  bool (*is_it)(View);
  const char* cause;
};
constexpr BinaryService kBinaryServices[] = {
    {IsTls, "the server expects TLS"},
    {IsIec104, "an IEC 60870-5-104 server answers"},
    {IsIsoOnTcp, "an S7 or IEC 61850 server answers (ISO on TCP)"},
    {IsDnp3, "a DNP3 outstation answers"},
};

}  // namespace

bool IsTelnet(View heard) {
  return heard.size() >= 3 && heard[0] == 0xFF && heard[1] >= 0xFB && heard[1] <= 0xFE &&
         heard[2] < 0x80;
}

std::optional<Finding> OtherService(View heard, bool modbus) {
  const auto other = [&](const char* cause, const char* remedy) {
    return Finding{.symptom = Symptom::other_protocol,
                   .bytes = heard.size(),
                   .cause = cause,
                   .remedy = remedy};
  };
  for (const Service& service : kServices) {
    if (AsText(heard).starts_with(service.begins)) return other(service.cause, kPortNumber);
  }
  for (const BinaryService& service : kBinaryServices) {
    if (service.is_it(heard)) return other(service.cause, kPortNumber);
  }
  if (IsTelnet(heard)) {
    return other("the server speaks Telnet", modbus ? kPortNumber : kNoTelnet);
  }
  return std::nullopt;
}

namespace {

/// In bytes. More bytes than this without a pause are not a message of a reader of cards or codes.
constexpr std::size_t kEndless = 240;
/// An echo contains at least kWholeEcho bytes of the request; beside a good reply, kPartOfEcho.
constexpr std::size_t kWholeEcho = 4;
constexpr std::size_t kPartOfEcho = 2;
constexpr std::size_t kAFew = 2;

struct Found {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t frames = 0;  ///< 1 plus the number of equal frames that follow
  bool others = false;     ///< a different frame follows
};

std::optional<Found> FindReply(const Hearing& hearing, View heard) {
  protocols::Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  std::optional<Found> found;
  Bytes first;
  while (const auto frame = assembler.Next(true)) {
    const std::size_t end = heard.size() - assembler.held();
    if (!found) {
      first = *frame;
      found = Found{end - frame->size(), end, 1, false};
    } else if (*frame == first) {
      ++found->frames;
      found->end = end;
    } else if (!bus::IsEmptyLine(*frame)) {
      found->others = true;
    }
  }
  return found;
}

Duration ArrivalOf(const Hearing& hearing, std::size_t byte) {
  Duration after{};
  for (const Arrival& arrival : hearing.arrivals) {
    if (arrival.at > byte) break;
    after = arrival.after;
  }
  return after;
}

Duration LongestPause(const Hearing& hearing, std::size_t begin, std::size_t end) {
  Duration longest{};
  for (std::size_t i = 1; i < hearing.arrivals.size(); ++i) {
    const Arrival& arrival = hearing.arrivals[i];
    if (arrival.at <= begin || arrival.at >= end) continue;
    longest = std::max(longest, arrival.after - hearing.arrivals[i - 1].after);
  }
  return longest;
}

/// True if the bytes are the beginning of a reply, without a fault so far.
bool IsBeginning(const Hearing& hearing, View heard) {
  protocols::Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  return !assembler.Next(false) && assembler.held() > 0 && assembler.blame() == Outcome::none;
}

/// Returns the length of the longest reply that has a fixed length; 0: no reply has a fixed length.
std::size_t OnlyLength(const Hearing& hearing) {
  std::size_t length = 0;
  for (const protocols::Shape& shape : hearing.expect->shapes) {
    if (shape.min_length == shape.max_length) length = std::max(length, shape.max_length);
  }
  return length;
}

/// True if a correct check value would make the bytes a whole reply, or if no check value can be
/// computed.
bool HasForm(const Hearing& hearing, View heard) {
  const protocols::PduCarrier* const carrier = hearing.protocol->carrier;
  if (carrier == nullptr || heard.size() < 2) return true;
  const Bytes nothing = carrier->wrap(heard[0], {});
  if (heard.size() <= nothing.size()) return true;
  const Bytes whole = carrier->wrap(heard[0], heard.subspan(1, heard.size() - nothing.size()));
  return hearing.protocol->reply_rule(whole, *hearing.expect, true).kind ==
         protocols::Cut::Kind::frame;
}

/// True if a reply of fixed length has as many bytes as `heard`. If it is not the longest reply,
/// the bytes must also have its form (HasForm).
bool HasOnlyLength(const Hearing& hearing, View heard) {
  const bool fits = std::ranges::any_of(hearing.expect->shapes, [&](const protocols::Shape& shape) {
    return shape.min_length == shape.max_length && shape.max_length == heard.size();
  });
  // The beginning of a longer reply can have the length of a refusal.
  return fits && (heard.size() == OnlyLength(hearing) || HasForm(hearing, heard));
}

/// True for a text with a line end, in a protocol whose replies are text.
bool IsWholeText(const Hearing& hearing, View heard) {
  if (!std::ranges::all_of(hearing.request, IsPrintable)) return false;
  return std::ranges::all_of(heard, IsPrintable) && (heard.back() == '\r' || heard.back() == '\n');
}

Outcome BlameOf(const Hearing& hearing, View heard) {
  protocols::Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  while (assembler.Next(true)) {
  }
  return assembler.blame();
}

/// True for 00 and FF: they come from a line without bias.
bool IsIdle(View bytes) {
  return std::ranges::all_of(bytes, [](auto byte) { return byte % 0xFF == 0; });
}

/// True if `heard` begins with a part of the request: its beginning; its end, if the receiver was
/// switched on during the request; or the whole request with at most a quarter of its bytes
/// changed. `beside`: there is also a good reply, so a shorter part is enough.
bool IsEcho(const Hearing& hearing, View heard, bool beside) {
  const View request = hearing.request;
  if (hearing.expect->mirrors || hearing.protocol->tcp) return false;
  const std::size_t least = std::min(beside ? kPartOfEcho : kWholeEcho, request.size() - 1);
  for (std::size_t lost = 0; lost <= request.size() / 2; ++lost) {
    const View rest = request.subspan(lost);
    const View part = heard.first(std::min(heard.size(), rest.size()));
    std::size_t same = 0;
    for (std::size_t i = 0; i < part.size(); ++i) same += part[i] == rest[i] ? 1 : 0;
    const bool whole = part.size() == rest.size() && 4 * same >= 3 * part.size();
    // A damaged reply may begin like its request, so a short part is not enough.
    const bool piece = same == part.size() && (beside || 2 * same > request.size());
    if ((whole || piece) && same >= least && !IsIdle(part)) return true;
  }
  return false;
}

Finding Beside(const Hearing& hearing, View heard, const Found& found) {
  const View before = heard.first(found.begin);
  const View behind = heard.subspan(found.end);
  // A line end before a reply belongs to the reply, so it is removed.
  View echo = before;
  while (!echo.empty() && IsLineEnd(echo.back())) echo = echo.first(echo.size() - 1);
  if (IsEcho(hearing, echo, true)) {
    return {.symptom = Symptom::noise_before, .cause = std::string(kOwnRequest)};
  }
  for (const View part : {before, behind}) {
    if (auto stranger = Stranger(hearing, part)) return *stranger;
  }
  if (found.others) return {.symptom = Symptom::others_beside};
  if (found.frames > 1) return {.symptom = Symptom::copies};
  return StrayBeside(hearing, before, behind);
}

/// Returns why an exchange failed although a whole reply came.
Finding Untaken(const Hearing& hearing, std::size_t echo, const Found& found) {
  const Duration pause = LongestPause(hearing, echo + found.begin, echo + found.end);
  const Duration after = ArrivalOf(hearing, echo + found.begin);
  if (found.frames == 1 && pause > hearing.gap) return {.symptom = Symptom::split, .time = pause};
  if (after > hearing.reply) return {.symptom = Symptom::late, .time = after};
  const View heard = hearing.heard.subspan(echo);
  if (auto login = LoginPrompt(hearing, heard)) return *login;
  if (auto comma = DecimalComma(hearing, heard)) return *comma;
  if (auto recognised = Recognise(hearing, heard)) return *recognised;
  return {.symptom = found.others ? Symptom::two_replies : Symptom::odd};
}

/// Returns the finding for bytes that begin like a reply but contain none.
Finding Broken(const Hearing& hearing, View heard) {
  const std::size_t length = OnlyLength(hearing);
  const Duration pause = LongestPause(hearing, 0, hearing.heard.size());
  // If more bytes came than a reply has, the pause only separates the reply from noise.
  if (pause > hearing.gap && (length == 0 || heard.size() <= length)) {
    return {.symptom = Symptom::split, .time = pause};
  }
  // The beginning of a longer reply can have the length of a refusal, so HasOnlyLength comes later.
  const bool broke_off = hearing.outcome == Outcome::partial;
  if (broke_off && heard.size() + kAFew < length && IsBeginning(hearing, heard)) {
    return {.symptom = Symptom::tail_lost};
  }
  if (HasOnlyLength(hearing, heard)) return {.symptom = Symptom::bad_check};
  if (length > kAFew && heard.size() < length && heard.size() + kAFew >= length) {
    return {.symptom = Symptom::bytes_lost};
  }
  if (heard.size() < length && IsWholeText(hearing, heard)) return {.symptom = Symptom::bytes_lost};
  if (length > 0 && heard.size() > length && heard.size() <= length + kAFew) {
    return {.symptom = Symptom::bytes_added};
  }
  if (IsWholeText(hearing, heard)) return {.symptom = Symptom::bad_check};
  if (IsBeginning(hearing, heard)) return {.symptom = Symptom::tail_lost};
  return {.symptom = Symptom::damaged};
}

/// True if the messages of a device that sends unasked are examined.
bool IsStanding(const Hearing& hearing) {
  return hearing.expect->reply == protocols::Expectation::Reply::standing;
}

/// Returns the greatest length of a message; more bytes are without end. A message at another bit
/// rate may be read as up to kEndless bytes.
std::size_t LongestHeard(const Hearing& hearing) {
  const std::size_t most = hearing.expect->max_bytes;
  return IsStanding(hearing) ? std::max(kEndless, most) : most;
}

/// True if the text has a known meaning: only then does RemedyFor return a remedy.
bool IsTold(const Finding& words) { return !words.remedy.empty(); }

Finding Unreadable(const Hearing& hearing, View heard) {
  if (auto service = hearing.connection ? OtherService(heard, hearing.protocol->tcp) : std::nullopt)
    return *service;
  if (auto doubled = DoubledBytes(hearing, heard)) return *doubled;
  if (LacksFirstByte(hearing, heard)) return {.symptom = Symptom::head_lost};
  if (auto too_short = TooShort(hearing, heard)) return *too_short;
  if (auto login = LoginPrompt(hearing, heard)) return *login;
  if (auto comma = DecimalComma(hearing, heard)) return *comma;
  auto recognised = Recognise(hearing, heard);
  const bool other_form = recognised && recognised->symptom == Symptom::other_form;
  if (recognised && !other_form) return *recognised;
  if (auto foreign = OtherFrame(hearing, heard)) return *foreign;
  if (BlameOf(hearing, heard) == Outcome::unexpected) return {.symptom = Symptom::other_reply};
  const bool ends = std::ranges::find(heard, '\n') != heard.end();
  if (heard.size() > LongestHeard(hearing) && !(ends && IsLine(hearing, heard)))
    return {.symptom = Symptom::endless};
  const bool of_reply = IsHexText(hearing, heard) || EndsInCheckValue(hearing, heard);
  auto words = of_reply ? std::nullopt : Words(hearing, heard);
  if (words && (!other_form || IsTold(*words))) return *words;
  if (auto nearly = NearlyReply(hearing, heard)) {
    // If the same bytes come twice in a row for the same request, they are the usual form of this
    // device and no damage (ReplyHabits::Compare). The finding then needs the cause.
    if (other_form && nearly->symptom == Symptom::bytes_lost) {
      nearly->cause = recognised->cause;
      nearly->remedy = recognised->remedy;
    }
    return *nearly;
  }
  if (auto line = Words(hearing, heard, true); line && (!other_form || IsTold(*line))) return *line;
  // Replies of this protocol are text, and the device has sent a text of another form.
  if (other_form) return *recognised;
  if (IsIdle(heard)) return {.symptom = Symptom::zeros};
  if (IsStanding(hearing)) {
    const bool words = std::ranges::all_of(heard, IsPrintable);
    return {.symptom = words ? Symptom::damaged : Symptom::noise};
  }
  if (!BeginsLikeReply(hearing, heard)) return {.symptom = Symptom::noise};
  return Broken(hearing, heard);
}

std::uint8_t SpecialsIn(const Hearing& hearing, View heard) {
  const bool high = std::ranges::any_of(heard, [](auto byte) { return byte > 0x7F; });
  // Text contains no bytes above 7F, so the missing eighth bit says nothing about the data bits.
  const bool text = std::ranges::all_of(hearing.request, IsPrintable);
  unsigned bits = SpecialsOf(heard) | (high || text ? kHighBit : 0U);
  // If all bytes are equal, they have one parity anyway, so they are not counted.
  const bool various = std::ranges::adjacent_find(heard, std::not_equal_to()) != heard.end();
  for (const std::uint8_t byte : various ? heard : View()) {
    if (byte == 0x00 || byte == 0xFF) continue;  // an idle or broken line also gives these bytes
    bits |= std::popcount(byte) % 2 == 0 ? kEvenByte : kOddByte;
  }
  return static_cast<std::uint8_t>(bits);
}

}  // namespace

Finding Plain(const Hearing& hearing) {
  return {.bytes = hearing.heard.size(),
          .expected = OnlyLength(hearing),
          .specials = SpecialsIn(hearing, hearing.heard)};
}

std::optional<Finding> Greeting(const Hearing& hearing, View heard) {
  if (auto service = hearing.connection ? OtherService(heard, hearing.protocol->tcp) : std::nullopt)
    return service;
  if (auto words = Words(hearing, heard, true)) return words;
  if (!hearing.protocol->tcp || heard.size() <= kHarmless) return std::nullopt;
  return Finding{
      .symptom = Symptom::other_protocol,
      .bytes = heard.size(),
      .cause = "the server sends first, which no Modbus TCP server does (" + Quote(heard) + ")",
      .remedy = "check the host and the port number of the line"};
}

Finding Examine(const Hearing& hearing) {
  const bool answered = ProvesLife(hearing.outcome);
  View heard = hearing.heard;
  if (heard.empty()) {
    return {.symptom = answered ? Symptom::clean : Symptom::silence,
            .expected = OnlyLength(hearing)};
  }
  std::size_t echo = 0;
  if (!hearing.expect->mirrors && heard.size() >= hearing.request.size() &&
      std::ranges::equal(heard.first(hearing.request.size()), hearing.request)) {
    echo = hearing.request.size();
    heard = heard.subspan(echo);
    if (heard.empty()) return {.symptom = answered ? Symptom::clean : Symptom::echo, .bytes = echo};
  }
  const auto found = FindReply(hearing, heard);
  Finding finding;
  if (!answered && IsEcho(hearing, heard, false)) {
    finding = {.symptom = Symptom::late_echo, .cause = std::string(kOwnRequest)};
  } else if (answered) {
    if (found) finding = Beside(hearing, heard, *found);
  } else {
    finding = found ? Untaken(hearing, echo, *found) : Unreadable(hearing, heard);
  }
  if (finding.bytes == 0) finding.bytes = heard.size();
  finding.expected = OnlyLength(hearing);
  finding.specials = SpecialsIn(hearing, heard);
  return finding;
}

}  // namespace baudgate::diagnosis
