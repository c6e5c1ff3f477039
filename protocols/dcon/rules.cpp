// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/rules.h"

#include <algorithm>
#include <string_view>

#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/common/settings.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/points.h"

namespace baudgate::protocols::dcon {
namespace {

/// Returns the lead characters and lengths of the possible replies to `command`: the good reply,
/// and the refusal `?`, which any command can get.
std::vector<Shape> Shapes(const Command& command, bool checksum) {
  // Length of the parts around the data: lead character, CR, and the checksum if it is on.
  const std::size_t extra = checksum ? 4 : 2;
  const auto form = DefaultForm(command.text);
  std::vector<Shape> shapes = {{'?', extra, extra + 2}};
  if (command.text == kAskSample) {
    shapes.push_back({'>', extra + 3, kMaxFrame});
    shapes.push_back({'!', extra, kMaxFrame});
    return shapes;
  }
  if (!form) {
    shapes.push_back({'>', extra, extra + 2});
    shapes.push_back({'!', extra, kMaxFrame});
    return shapes;
  }
  const bool several = command.text.starts_with("#") || command.text.starts_with("^") ||
                       // The reply to "$A" is `!` with a mask, or the gate of a counter.
                       command.text == "$A";
  const bool data = *form == Form::numbers || *form == Form::number || *form == Form::words ||
                    *form == Form::bits;
  if (data) shapes.push_back({'>', extra + 4, kMaxFrame});
  if (!data || several) shapes.push_back({'!', extra + 2, kMaxFrame});
  return shapes;
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  Expectation expect;
  expect.max_bytes = kMaxFrame;
  expect.checksum = settings.checksum ? kChecksum : kNoChecksum;
  if (request.empty()) return expect;
  const auto command = ParseRequest(request, settings.checksum);
  if (!command) {
    expect.repeatable = false;
    return expect;
  }
  if (command->broadcast) {
    expect.reply = Expectation::Reply::none;
    expect.repeatable = false;
    return expect;
  }
  expect.checksum = ReplyVariant(command->text, settings);
  expect.repeatable = IsRepeatable(command->text);
  expect.shapes = Shapes(*command, settings.checksum);
  const auto form = DefaultForm(command->text);
  // A module that was started with INIT* grounded answers at 00, and the reply to `$002` contains
  // its stored address, so its address is not compared.
  const bool init = command->text == "$2" && command->address == 0;
  const bool asked = InputOfQuestion(command->text) || command->text == "$5";
  if (!init && (asked || form == Form::text || form == Form::readback || form == Form::hex)) {
    Append(expect.address, HexByte(ReplyAddress(*command)));
  }
  return expect;
}

// CutLine cuts lines from a start character to CR. If the checksum is on, it cuts only lines with a
// correct checksum.
//
//   > 23 30 31 38 34 0D                      #01 84 CR
//   < 3E 2B 31 30 30 2E 32 33 2B 33 34 2E 30 35 30 45 32 0D
//                                            > +100.23 +34.050 E2 CR
//   > 23 30 31 30 42 34 0D                   #010 B4 CR to a counter module, which answers with the
//   < 3E 44 34 30 30 30 30 30 30 31 45 0D    > D4 0000001E CR checksum in front (I-7080)
//
// A line contains no second start character: if one comes, the first line was cut off. With a
// checksum, the line begins at the start character from which the checksum fits. If the checksum
// fits from two start characters, the later is used: the earlier fits only if the bytes between
// them happen to sum to zero.

namespace {

constexpr std::string_view kRequestStarts = "$#%@~^";
constexpr std::string_view kReplyStarts = ">!?";

bool IsText(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

Cut CutLine(View held, const Expectation& expect, std::string_view starts) {
  const std::string_view text = AsText(held);
  if (starts.find(text.front()) == std::string_view::npos)
    return cut::SkipNoise(held, starts, "\n");

  const auto stop = std::find_if_not(held.begin(), held.end(), IsText);
  const auto length = static_cast<std::size_t>(stop - held.begin());
  const std::string_view line = text.substr(0, length);
  if (expect.checksum == kNoChecksum) {
    const auto later = line.substr(0, expect.max_bytes).find_first_of(starts, 1);
    if (later != std::string_view::npos) {
      return Cut::Discard(later, Outcome::partial, "another frame begins");
    }
  }
  if (length + 1 > expect.max_bytes) {
    return cut::TooLong();
  }
  if (stop == held.end()) return Cut::NeedMore();
  if (*stop != '\r') return Cut::Discard(length + 1, Outcome::corrupt, "not a text character");
  if (expect.checksum == kNoChecksum) return Cut::Frame(length + 1);

  for (auto at = line.find_last_of(starts); at != std::string_view::npos;
       at = at == 0 ? std::string_view::npos : line.find_last_of(starts, at - 1)) {
    if (!ChecksumFits(line.substr(at), expect.checksum)) continue;
    if (at == 0) return Cut::Frame(length + 1);
    return Cut::Discard(at, Outcome::corrupt, "another frame begins");
  }
  return cut::BadChecksum(length + 1);
}

}  // namespace

Cut RequestRule(View held, const Expectation& expect, bool) {
  return CutLine(held, expect, kRequestStarts);
}

// Cuts replies. Skips the reply of another module if replies to this request contain an address.
// Example: module 01 was asked for its name, and a reply of module 02 comes:
//   < 21 30 32 37 30 31 37 45 42 0D          !02 7017 EB CR
Cut ReplyRule(View held, const Expectation& expect, bool) {
  const Cut line = CutLine(held, expect, kReplyStarts);
  const bool names_module = line.kind == Cut::Kind::frame && held[0] != '>';
  if (!names_module || expect.address.empty()) return line;
  if (AsText(held).substr(1).starts_with(AsText(expect.address))) return line;
  return cut::OfAnother(line.size);
}

namespace {

constexpr config::SerialSettings kSerials[] = {{.baud = 9600},
                                               {.baud = 115200},
                                               {.baud = 19200},
                                               {.baud = 38400},
                                               {.baud = 57600},
                                               {.baud = 4800},
                                               {.baud = 2400},
                                               {.baud = 1200},
                                               {.baud = 9600, .parity = config::Parity::even},
                                               {.baud = 9600, .parity = config::Parity::odd},
                                               {.baud = 9600, .stop_bits = 2}};

constexpr ScanMode kModes[] = {{}, {"checksum", "true"}};
constexpr std::size_t kWithChecksum = 1;

constexpr const char* kScanQuestions[] = {kAskName, kAskType};
constexpr std::size_t kConfiguration = 8;

Bytes AskModule(unsigned address, std::size_t mode, std::size_t question) {
  return BuildRequest(kScanQuestions[question], static_cast<std::uint8_t>(address),
                      mode == kWithChecksum);
}

/// Judges a reply to a question of a scan. A module that was started with INIT* grounded answers at
/// 00, and its reply to `$002` contains its stored address.
Sighting JudgeModule(View request, View frame, std::size_t mode) {
  const bool checksum = mode == kWithChecksum;
  const auto asked = ParseRequest(request, checksum);
  const auto reply = ParseReply(frame, checksum ? kChecksum : kNoChecksum);
  Sighting sighting;
  if (!asked || !reply || reply->lead == '>' || reply->body.size() < 2) return sighting;
  const bool init = asked->address == 0 && asked->text == kAskType;
  if (reply->body.substr(0, 2) != HexByte(asked->address) && !init) return sighting;
  if (reply->lead == '?') {
    if (reply->body.size() == 2) sighting.what = Sighting::What::device;
    return sighting;
  }
  if (asked->text == kAskType) {
    if (reply->body.size() != kConfiguration || !IsHexText(reply->body)) return sighting;
    sighting.what = Sighting::What::device;
    return sighting;
  }
  sighting.what = Sighting::What::device;
  sighting.identity = Trim(std::string_view(reply->body).substr(2));
  if (sighting.identity.empty()) return sighting;
  sighting.names = {sighting.identity};
  sighting.point = "{ name: module_name, read: \"$M\", type: string(16), group: slow }";
  return sighting;
}

}  // namespace

const ScanRule kScan = {.serials = kSerials,
                        .first_address = 0,
                        .last_address = 255,
                        .modes = kModes,
                        .quick_modes = 2,
                        .questions = 2,
                        .finds = 0b11,
                        .quick_finds = 0b01,
                        .usual = 60ms,
                        .ask = AskModule,
                        .judge = JudgeModule};

namespace {

constexpr std::string_view kLeads = "$#%@~^";
constexpr std::string_view kPlace = "XX";

/// Makes a whole frame of a typed command: adds CR, and replaces a final XX by the checksum. If the
/// option checksum is on, a missing checksum is added even without XX. Example: `$01MXX` gives
/// `$01MD2` and CR.
Result<Bytes> CompleteCommand(View written, const Settings& settings) {
  std::string text(Trim(AsText(written)));
  if (text.size() < 3 || kLeads.find(text[0]) == std::string_view::npos) {
    return Error{"a DCON command needs one of $ # % @ ~ ^ and then the address, as in '$01M'"};
  }
  const bool printable = std::ranges::all_of(text, [](char c) { return c > 0x20 && c < 0x7F; });
  if (!printable)
    return Error{"a DCON command can contain only printable characters and no blanks"};
  const bool asked_for = text.size() > 4 && text.ends_with(kPlace);
  if (asked_for) text.resize(text.size() - kPlace.size());
  const bool carried = text.size() > 4 && ChecksumFits(text, kChecksum);
  if (asked_for || (settings.checksum && !carried)) {
    text += HexByte(Sum8(ToBytes(text)));
  }
  if (text.size() >= kMaxFrame) return Error{"a DCON command has at most 267 characters"};
  text += '\r';
  return ToBytes(text);
}

bool IsRead(View request, const Settings&) {
  const auto proven = [](const std::optional<Command>& command) {
    return command && !command->broadcast &&
           (command->text == kAskName || command->text == kAskType);
  };
  return proven(ParseRequest(request, false)) || proven(ParseRequest(request, true));
}

}  // namespace

const TelegramRule kTelegram = {kLeads, kWithSettings<CompleteCommand>, kWithSettings<IsRead>};

namespace {

constexpr std::string_view kAsks = "$#%@~^";
constexpr std::string_view kAnswers = ">!?";

/// The length of the longest read command, such as "$01A1".
constexpr std::size_t kLongestRead = 5;
constexpr std::size_t kChecksumDigits = 2;

bool IsText(std::string_view line) {
  return std::ranges::all_of(line, [](char c) { return c >= 0x20 && c < 0x7F; });
}

Recognised OtherChecksum(bool carried) {
  return {Recognised::What::other_setting,
          carried ? "its replies carry a checksum" : "its replies carry no checksum",
          std::string("set checksum: ") + (carried ? "true" : "false") +
              " in the configuration, or change the checksum in the module"};
}

/// True for a whole reply without a checksum: an acknowledgement, or numbers of the configured
/// width and nothing after them. A reply that ends with a wrong checksum does not fit.
bool IsBare(std::string_view line, std::string_view asked, std::size_t width) {
  if (line[0] != '>') return line.size() == 3 && line.substr(1, 2) == asked.substr(1, 2);
  if (width == 0 || line.size() <= width || (line[1] != '+' && line[1] != '-')) return false;
  return (line.size() - 1) % width == 0;
}

/// True if the reply contains an address that is not expected: ">03+01.234" instead of ">+01.234".
bool CarriesAddress(std::string_view line, std::string_view asked) {
  return line[0] == '>' && line.size() > 3 && line.substr(1, 2) == asked.substr(1, 2) &&
         (line[3] == '+' || line[3] == '-');
}

std::optional<Recognised> OfLine(std::string_view line, std::string_view asked,
                                 const Settings& settings) {
  const bool checksum = settings.checksum;
  const auto lead = line.find_first_of(std::string(kAsks) + std::string(kAnswers));
  if (lead == std::string_view::npos) return std::nullopt;
  line.remove_prefix(lead);
  if (line.size() < 3 || !IsText(line)) return std::nullopt;
  if (kAsks.find(line[0]) != std::string_view::npos) {
    // Without a checksum a damaged reply can look like a request, so only lines as short as a read
    // command count.
    const bool plain = checksum ? ChecksumFits(line, kChecksum) : line.size() <= kLongestRead;
    if (line == asked || !plain || !ParseInteger<int>(line.substr(1, 2), 16)) return std::nullopt;
    return Recognised{Recognised::What::other_master,
                      "another master sends on the line: it has sent '" + std::string(line) + "'",
                      "a serial line can have only one master; remove the other master"};
  }
  const bool fits = line.size() > 3 && ChecksumFits(line, kChecksum);
  if (fits && !checksum) return OtherChecksum(true);
  if (!fits && checksum && line.size() > 4 && ChecksumFits(line.substr(1), kChecksum)) {
    return Recognised{
        Recognised::What::other_setting,
        "its checksum does not count the first character '" + std::string(line.substr(0, 1)) + "'",
        "update its firmware, or set checksum: false here and in the module"};
  }
  if (!fits && checksum && IsBare(line, asked, settings.width)) return OtherChecksum(false);
  if (!settings.data_address && fits == checksum && CarriesAddress(line, asked)) {
    return Recognised{Recognised::What::other_setting, "its replies with '>' carry its address",
                      "set data_address: true in the configuration"};
  }
  if (line[0] != '>' && line.substr(1, 2) != asked.substr(1, 2) && fits == checksum) {
    return Recognised{Recognised::What::other_device,
                      "module " + std::string(line.substr(1, 2)) + " answers where " +
                          std::string(asked.substr(1, 2)) + " was asked",
                      "check the address that is set in the module"};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  std::string_view asked = AsText(request);
  if (asked.size() < 4) return std::nullopt;
  asked.remove_suffix(1);
  std::string_view text = AsText(heard);
  for (auto end = text.find('\r'); end != std::string_view::npos; end = text.find('\r')) {
    if (auto found = OfLine(text.substr(0, end), asked, settings)) {
      return found;
    }
    text.remove_prefix(end + 1);
  }
  return std::nullopt;
}

std::optional<std::string> ForeignDcon(View heard) {
  std::string_view text = AsText(heard);
  for (auto end = text.find('\r'); end != std::string_view::npos; end = text.find('\r')) {
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    const auto lead = line.find_last_of(kAsks);
    if (lead == std::string_view::npos) continue;
    line.remove_prefix(lead);
    const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'F'); };
    const bool fits = line.size() >= 3 && line.size() <= kLongestRead + kChecksumDigits;
    if (!fits || !IsText(line) || !is_digit(line[1]) || !is_digit(line[2])) continue;
    return "requests of DCON come ('" + std::string(line) + "')";
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols::dcon
