// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/rules.h"

#include <algorithm>
#include <cctype>
#include <string>

#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/common/settings.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {
namespace {

/// Returns the maximum number of bytes in a reply. Text items have up to 131 characters, and the
/// slave decides how long a list is.
std::size_t LongestReply(const Command& command) {
  constexpr std::size_t kItem = 132;
  const std::size_t one_line = kLongestLine + 3;
  if (command.write) return one_line;
  if (std::string_view("LBAM").find(command.category) != std::string_view::npos) return kMaxReply;
  const std::size_t items = std::min<std::size_t>(command.ItemCount(), kMaxReply / kItem);
  return std::clamp(items * kItem + items / 2 * 3 + 16, one_line, kMaxReply);
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  Expectation expect;
  expect.checksum = ChecksumBits(settings);
  if (request.empty()) {
    expect.max_bytes = kMaxLine + 1;
    return expect;
  }
  const ReceivedRequest received = ParseRequest(request);
  if (!received.command) {
    expect.max_bytes = kMaxReply;
    expect.repeatable = false;
    return expect;
  }
  const Command& command = *received.command;
  if (command.slave == kBroadcast) expect.reply = Expectation::Reply::none;
  expect.address = ToBytes(std::to_string(command.slave));
  expect.max_bytes = LongestReply(command);
  const std::size_t head = expect.address.size();
  // The numbers are the bytes around the content: `<`, slave, type, colons, checksum, CR and LF.
  expect.shapes.push_back({'N', head + 7, kLongestLine + 2});
  if (command.write) {
    expect.shapes.push_back({'A', head + 6, head + 7});
  } else {
    expect.shapes.push_back({'D', head + 7, expect.max_bytes});
  }
  // Writes and L are not repeated: a write may have been executed although no reply came, and a
  // second L would lose events.
  expect.repeatable = !command.write && command.category != 'L';
  if (command.write && command.category == 'V' && command.numbers &&
      command.numbers->first <= kPasswordItems.last &&
      command.numbers->last >= kPasswordItems.first) {
    expect.secrets.emplace_back(received.data_at, command.data.size());
    // The checksum is secret, too, because the password can be computed from it.
    expect.secrets.emplace_back(received.data_at + command.data.size() + 1, 2);
  }
  return expect;
}

// The rules cut SPA messages from `>` or `<` to CR:
//
//   > 3E 31 52 46 3A 32 31 0D                        >1RF:21           what is slave 1?
//   < 0A 3C 31 44 3A 30 2E 35 32 2F 31 3A 36 30 0D 0A
//                                                    <1D:0.52/1:60     two values
//   < 0A 3C 31 41 3A 37 36 0D 0A                     <1A:76            a write is acknowledged
//   < 0A 3C 31 4E 3A 35 3A 37 36 0D 0A               <1N:5:76          refused, code 5
//   < 0A 3C 33 44 3A 31 2E 30 30 26 0D 0A 30 2F ... 3A CC CC 0D 0A     & CR LF: the reply goes on
//
// A message contains no second `<` or `>`, so each of them ends an incomplete message before it.
// Fibre rings return every request to the master, so a request among replies is skipped as an echo.

namespace {

/// The result of ScanText: `open`: the message may go on; `whole`: CR ends it; `broken`: the bytes
/// are no message.
struct Scan {
  enum class State { open, broken, whole } state = State::open;
  /// For `whole`: length of the message with its CR; for `broken`: number of bytes that are not a
  /// message.
  std::size_t size = 0;
  std::string_view why;
};

/// Searches the end of a message, which begins at its start character and ends in CR.
/// `may_continue`: `&` in front of CR continues the message in another line, as in replies.
Scan ScanText(View held, bool may_continue) {
  std::size_t line_start = 0;
  std::size_t lines = 1;
  for (std::size_t i = 1; i < held.size(); ++i) {
    const std::uint8_t byte = held[i];
    const bool after_ampersand = may_continue && held[i - 1] == '&';
    if (byte == kCr) {
      if (!after_ampersand) return {Scan::State::whole, i + 1, {}};
      if (i + 1 == held.size()) return {};
      if (held[i + 1] != kLf)
        return {Scan::State::broken, i + 1, "the line feed is missing after & CR"};
      if (++lines > kMaxLines) return {Scan::State::broken, i + 1, "more than 16 lines"};
      line_start = ++i + 1;
    } else if (byte == '<' || byte == '>') {
      return {Scan::State::broken, i, "another message cut this message short"};
    } else if (!IsPrintable(byte)) {
      return {Scan::State::broken, i, "the message has a character that is not allowed on the bus"};
    } else if (after_ampersand) {
      return {Scan::State::broken, i, "& inside a line"};
    } else if (i - line_start >= kLongestLine) {
      return {Scan::State::broken, i, "the message has a line of more than 256 characters"};
    }
  }
  return {};
}

/// Skips the bytes in front of the next message. CR and LF among them do not count as damage.
Cut SkipTo(View held, std::string_view starts) { return cut::SkipNoise(held, starts, "\r\n"); }

/// Skips a request that a fibre ring has returned.
Cut SkipEcho(View held, bool idle) {
  constexpr std::string_view kWhy = "echo of a request";
  const Scan scan = ScanText(held, false);
  if (scan.state != Scan::State::open) return Cut::Discard(scan.size, Outcome::none, kWhy);
  return idle ? Cut::Discard(held.size(), Outcome::none, kWhy) : Cut::NeedMore();
}

}  // namespace

// Cuts replies. A reply of another slave is skipped. Example: 3C 32 44 3A 30 3A 37 41 0D 0A
// (<2D:0:7A) while slave 1 is asked.
Cut ReplyRule(View held, const Expectation& expect, bool idle) {
  if (held[0] == '>') return SkipEcho(held, idle);
  if (held[0] != '<') return SkipTo(held, "<>");
  const Scan scan = ScanText(held, true);
  if (scan.state == Scan::State::open) return Cut::NeedMore();
  if (scan.state == Scan::State::broken) {
    return Cut::Discard(scan.size, Outcome::corrupt, scan.why);
  }
  const View text = held.first(scan.size);
  if (scan.size >= expect.max_bytes) {
    return cut::TooLong(scan.size);
  }
  const auto reply = ParseReply(text);
  if (!reply) return Cut::Discard(scan.size, Outcome::corrupt, "syntax");
  if (!ChecksumPasses(text, expect.checksum)) {
    return cut::BadChecksum(scan.size);
  }
  if (!expect.address.empty() && std::to_string(reply->slave) != AsText(expect.address)) {
    return cut::OfAnother(scan.size);
  }
  // The LF after the CR belongs to the frame; otherwise it would be a stray byte in the next
  // exchange. Replies without the LF are accepted, too.
  if (scan.size == held.size()) return idle ? Cut::Frame(scan.size) : Cut::NeedMore();
  return Cut::Frame(held[scan.size] == kLf ? scan.size + 1 : scan.size);
}

Cut RequestRule(View held, const Expectation& expect, bool) {
  if (held[0] != '>') return SkipTo(held, ">");
  const Scan scan = ScanText(held, false);
  if (scan.state == Scan::State::open) return Cut::NeedMore();
  if (scan.state == Scan::State::broken) {
    return Cut::Discard(scan.size, Outcome::corrupt, scan.why);
  }
  if (scan.size > expect.max_bytes) {
    return cut::TooLong(scan.size);
  }
  return Cut::Frame(scan.size);
}

namespace {

constexpr config::SerialSettings Even(int baud) {
  return {.baud = baud, .data_bits = 7, .parity = config::Parity::even};
}

constexpr config::SerialSettings kSerials[] = {
    Even(9600),
    Even(4800),
    Even(19200),
    Even(2400),
    Even(38400),
    Even(1200),
    {.baud = 9600, .data_bits = 7, .parity = config::Parity::odd},
    {.baud = 9600, .data_bits = 8},
    {.baud = 9600, .data_bits = 8, .parity = config::Parity::even}};

constexpr ScanMode kModes[] = {{}, {"send_xx", "true"}};

Bytes AskDesignation(unsigned address, std::size_t mode, std::size_t) {
  return Encode(ReadOf(address, {.channel = 0, .category = 'F', .number = {}}, 0), mode == 1);
}

Sighting JudgeDesignation(View request, View frame, std::size_t) {
  Sighting sighting;
  const auto reply = ParseReply(frame);
  if (!reply || reply->slave != ParseRequest(request).slave || reply->type == 'A') return sighting;
  sighting.what = Sighting::What::device;
  if (reply->type != 'D') return sighting;
  sighting.identity = Trim(reply->data);
  sighting.names = {sighting.identity};
  sighting.point = "{ name: designation, read: F, type: string(40), group: slow }";
  return sighting;
}

}  // namespace

// The addresses end at 899, because 900 is the number for broadcasts.
const ScanRule kScan = {.serials = kSerials,
                        .first_address = 1,
                        .last_address = 899,
                        .modes = kModes,
                        .usual = 80ms,
                        .ask = AskDesignation,
                        .judge = JudgeDesignation};

namespace {

/// Makes a whole frame of a typed telegram: `>1RF:`, `>1RF:XX` and `>1RF:21` give `>1RF:21` and CR.
/// With the option send_xx the frame has XX in place of the checksum.
Result<Bytes> CompleteMessage(View written, const Settings& settings) {
  std::string text(Trim(AsText(written)));
  if (!text.starts_with('>')) return Error{"an SPA telegram begins with '>', as in '>1RF:XX'"};
  const bool printable =
      std::ranges::all_of(text, [](char c) { return IsPrintable(static_cast<std::uint8_t>(c)); });
  if (!printable) return Error{"an SPA telegram has printable characters only"};
  if (text.ends_with(kWildcard)) text.resize(text.size() - kWildcard.size());
  if (text.ends_with(':')) {
    text += settings.send_wildcard ? std::string(kWildcard) : HexByte(Xor8(ToBytes(text)));
  }
  if (text.size() > kMaxLine) return Error{"an SPA telegram has at most 255 characters"};
  text += static_cast<char>(kCr);
  return ToBytes(text);
}

bool IsRead(View request, const Settings&) {
  const ReceivedRequest received = ParseRequest(request);
  return received.intact && received.command && !received.command->write &&
         received.command->slave != kBroadcast && received.command->category != 'L';
}

}  // namespace

const TelegramRule kTelegram = {">", kWithSettings<CompleteMessage>, kWithSettings<IsRead>};

namespace {

/// The length of the shortest message, "<1D:0:" without its checksum.
constexpr std::size_t kShortest = 6;

std::string Slave(unsigned slave) { return "slave " + std::to_string(slave); }

std::optional<Recognised> OtherForm(View message) {
  if (ParseReply(message) || MatchingReadings(message, false) == 0) return std::nullopt;
  return Recognised{Recognised::What::other_reply,
                    "its replies have a correct check value, but another form ('" +
                        std::string(Trim(AsText(message))) + "')",
                    "update the device's firmware, because it does not follow the SPA protocol"};
}

/// Recognises a reply of the requested slave that would be right if an option were set differently.
std::optional<Recognised> OtherOption(View message, const Settings& settings) {
  const auto other = [](const char* cause, const char* remedy) {
    return Recognised{Recognised::What::other_setting, cause, remedy};
  };
  const auto reply = ParseReply(message);
  if (reply && reply->wildcard && !settings.accept_wildcard) {
    return other("its replies carry XX instead of a checksum",
                 "set accept_xx: true in the configuration, or switch checksums on in the device");
  }
  const bool counts = settings.line_feed_in_checksum;
  if (reply && MatchingReadings(message, !counts) != 0 && MatchingReadings(message, counts) == 0) {
    return counts ? other("its checksums do not count the line feed before '<'",
                          "set lf_in_checksum: false in the configuration")
                  : other("its checksums count the line feed before '<'",
                          "set lf_in_checksum: true in the configuration");
  }
  if (message.size() > kShortest && message[message.size() - 2] == ':') {
    return other("its replies carry no checksum",
                 "check the device and any converter before it, because one of them does not "
                 "follow the SPA protocol");
  }
  return std::nullopt;
}

/// True if the slave number is missing in a reply: "<D:0:33" in place of "<1D:0:33".
bool IsNameless(View message, const std::string& name) {
  if (message.size() < 2 || !std::isalpha(message[1])) return false;
  Bytes named(message.begin(), message.begin() + 1);
  Append(named, ToBytes(name));
  Append(named, message.subspan(1));
  return MatchingReadings(named, false) != 0 || MatchingReadings(message, false) != 0;
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  const auto asked = ParseRequest(request).slave;
  while (!heard.empty()) {
    const auto begin = std::ranges::find_if(heard, [](auto c) { return c == '<' || c == '>'; });
    const auto end = std::find(begin, heard.end(), kCr);
    if (end == heard.end()) return std::nullopt;
    const View message(begin, end + 1);
    heard = View(end + 1, heard.end());
    if (message[0] == '>') {
      const ReceivedRequest other = ParseRequest(message);
      if (!other.intact || !other.slave || !other.command || std::ranges::equal(message, request))
        continue;
      return Recognised{Recognised::What::other_master,
                        "another master sends on the line: it has asked " + Slave(*other.slave),
                        "an SPA bus can have only one master; remove the other master"};
    }
    const auto reply = ParseReply(message);
    const std::string name = asked ? std::to_string(*asked) : std::string();
    if (asked && AsText(message).substr(1).starts_with(name)) {
      if (auto other = OtherOption(message, settings)) return other;
      if (auto other = OtherForm(message)) return other;
    }
    if (asked && IsNameless(message, name)) {
      return Recognised{Recognised::What::other_setting, "its replies carry no slave number",
                        "check the device and any converter before it, because one of them does "
                        "not follow the SPA protocol"};
    }
    if (!reply || !asked || reply->slave == *asked || MatchingReadings(message, false) == 0)
      continue;
    return Recognised{Recognised::What::other_device,
                      Slave(reply->slave) + " answers where " + Slave(*asked) + " was asked",
                      "check the address that is set at the device"};
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols::spabus
