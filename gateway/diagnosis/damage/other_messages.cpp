// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/other_messages.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/changed_bytes.h"

namespace baudgate {

namespace {

/// Fewer printable characters are no words, and letters alone no word.
constexpr std::size_t kShortestText = 6;
constexpr std::size_t kShortestWord = 5;
/// From here on a line of printable characters is one, whatever is in it.
constexpr std::size_t kLine = 8;
constexpr std::size_t kQuoted = 30;
/// So many lines that begin alike, in one exchange: nobody has asked for them.
constexpr std::ptrdiff_t kRepeated = 2;
constexpr std::size_t kAlike = 2;
/// Prompts for a user and a password.
constexpr std::string_view kLogins[] = {"login:", "username:", "password:", "logon:"};
/// Texts of a serial server whose port is in use.
constexpr std::string_view kInUse[] = {"in use", "busy", "too many", "occupied", "limit"};

bool IsLetter(std::uint8_t byte) {
  return (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z');
}

/// What a modem says.
bool IsModem(View heard) {
  constexpr std::string_view kWords[] = {"OK",   "ERROR",   "NO CARRIER", "BUSY",
                                         "RING", "CONNECT", "NO ANSWER",  "NO DIALTONE"};
  const std::string_view text = Trim(AsText(heard));
  return std::ranges::any_of(kWords, [&](std::string_view word) { return text.starts_with(word); });
}

/// In a binary protocol a few letters are words; where replies are text themselves, much of it.
bool IsWords(const Hearing& hearing, View heard) {
  while (!heard.empty() && IsLineEnd(heard.back())) heard = heard.first(heard.size() - 1);
  const auto printable = std::ranges::count_if(heard, IsPrintable);
  const auto letters = std::ranges::count_if(heard, IsLetter);
  const auto size = static_cast<std::ptrdiff_t>(heard.size());
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (binary && letters == size && heard.size() >= kShortestWord) return true;
  // "HB0001", or a telephone number: a packet of a radio or serial server.
  const bool name = std::ranges::all_of(heard, [](auto byte) { return std::isalnum(byte) != 0; });
  if (binary && name && heard.size() >= kShortestText) return true;
  if (heard.size() < kShortestText || 20 * printable < 19 * size) return false;
  return binary ? letters >= 3 : 5 * letters >= 2 * size;
}

/// One line after another that begins alike. Empty lines, as before a login, are none.
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

/// Messages of a modem that has no connection.
constexpr std::string_view kHungUp[] = {"no carrier", "no answer", "no dialtone"};

std::string RemedyFor(View heard) {
  if (IsModem(heard) && Has(heard, kHungUp)) {
    return "the modem has no connection: dial again, look at it and at its line";
  }
  if (Has(heard, kLogins)) {
    return "a login prompt: switch the console (getty) off at the other end, or check the port";
  }
  if (Repeats(heard)) {
    return "it sends by itself, asked or not: switch its automatic (continuous) output off";
  }
  return Has(heard, kInUse) ? "end its other client, or raise its limit of connections" : "";
}

Finding Text(const Hearing& hearing, View heard) {
  // A text behind a password may repeat the password.
  const bool secret = !hearing.expect->secrets.empty();
  return {.symptom = Symptom::text,
          .bytes = heard.size(),
          .cause = secret           ? std::string("behind a password, and so not shown")
                   : IsModem(heard) ? Quote(ToBytes(Trim(AsText(heard))))
                                    : Quote(heard),
          .remedy = RemedyFor(heard)};
}

}  // namespace

std::string Quote(View text) {
  std::string quoted = Printable(text.first(std::min(text.size(), kQuoted)));
  if (text.size() > kQuoted) quoted += "...";
  return "'" + quoted + "'";
}

bool IsLine(const Hearing& hearing, View heard) {
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (heard.size() < (binary ? kLine : 2 * kLine)) return false;
  return IsLineEnd(heard.back()) && std::ranges::all_of(heard, IsPrintable);
}

bool BeginsLikeReply(const Hearing& hearing, View heard) {
  const Expectation& expect = *hearing.expect;
  return std::ranges::any_of(heard.first(std::min<std::size_t>(heard.size(), 3)), [&](auto byte) {
    const bool address = !expect.address.empty() && byte == expect.address[0];
    const bool lead = !hearing.request.empty() && byte == hearing.request.front();
    return address || lead || std::ranges::any_of(expect.shapes, [byte](const Shape& shape) {
             return shape.tag > 0 && (shape.tag & 0xFF) == byte;
           });
  });
}

std::optional<Finding> Words(const Hearing& hearing, View heard, bool lines) {
  const bool likely = IsWords(hearing, heard) || (lines && IsLine(hearing, heard));
  if (!IsModem(heard) && (!likely || BeginsLikeReply(hearing, heard))) return std::nullopt;
  return Text(hearing, heard);
}

std::optional<Finding> LoginPrompt(const Hearing& hearing, View heard) {
  const std::string_view text = Trim(AsText(heard));
  const std::string_view line = text.substr(text.find_last_of("\r\n") + 1);
  const bool asks = line.ends_with(':') && Has(ToBytes(line), kLogins);
  if (!asks || !std::ranges::all_of(heard, IsPrintable)) return std::nullopt;
  return Text(hearing, heard);
}

std::optional<Finding> OtherFrame(const Hearing& hearing, View heard) {
  // Binary protocols have the same check value in frames of other forms.
  const bool binary = !std::ranges::all_of(hearing.request, IsPrintable);
  if (binary && !std::ranges::all_of(heard, IsPrintable)) return std::nullopt;
  for (const ForeignRule foreign : hearing.foreign) {
    if (foreign == hearing.protocol->foreign) continue;
    auto cause = foreign(heard);
    if (!cause) continue;
    return Finding{.symptom = Symptom::other_master,
                   .bytes = heard.size(),
                   .cause = std::move(*cause),
                   .remedy =
                       "another master and its devices are on this line: give each protocol "
                       "a line of its own"};
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

/// An alert, or a handshake.
bool IsTls(View heard) {
  return heard.size() >= 5 && (heard[0] == 0x15 || heard[0] == 0x16) && heard[1] == 3 &&
         heard[2] <= 4;
}

/// STARTDT, STOPDT or TESTFR, asked or confirmed; or an acknowledgement.
bool IsIec104(View heard) {
  if (heard.size() < 6 || heard[0] != 0x68 || heard[1] != 4) return false;
  const bool unnumbered = (heard[2] & 3) == 3 && heard[3] == 0 && heard[4] == 0 && heard[5] == 0;
  return unnumbered || (heard[2] == 1 && heard[3] == 0);
}

/// ISO on TCP, with a whole packet that confirms, refuses or carries data.
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
    {IsTls, "the server wants TLS"},
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

}  // namespace baudgate
