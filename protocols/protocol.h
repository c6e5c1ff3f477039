// The contract of protocol plugins. A protocol is one folder of protocols/ and one loadable module;
// the module hands out one Protocol, a table of texts, data and functions. Read this file first,
// then frame_rule.h, conversation.h and twin.h. docs: protocols/README.md walks through a whole
// one. TransactionBytes is the size of the number in front of a Modbus TCP frame.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "config/model/modbus.h"
#include "config/model/options.h"
#include "config/model/point.h"
#include "config/model/serial.h"
#include "config/model/timing.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "protocols/conversation.h"
#include "protocols/frame_rule.h"
#include "protocols/options.h"
#include "protocols/scanning.h"
#include "protocols/twin.h"

namespace baudgate::config {
class Problems;
class YamlNode;
}  // namespace baudgate::config

namespace baudgate::protocols {

/// A way to read a point, for `baudgate protocols NAME`.
struct DecoderSpec {
  std::string_view form{};  ///< "I1", "float_le@0"
  std::string_view help{};
};

/// Something wrong with a device (Protocol::faults), or possible but hardly meant
/// (Protocol::doubts).
struct ConfigRemark {
  std::size_t point = kNoPoint;  ///< index of the point that it is about; kNoPoint: the address
  std::string text{};            ///< one sentence: what it leads to, and what to do
};

/// The times of a protocol as data (docs/timeouts.md): how long its devices take at any bit rate.
struct TimingRule {
  /// The longer one of `least`, and of `characters` character times and `plus` together.
  /// {.least = 5ms, .characters = 7} at 9600 bit/s, 11 bits: 8.02 ms; at 115200: 5 ms.
  struct Span {
    Duration least{};
    double characters = 0;
    Duration plus{};

    constexpr Duration At(Duration character) const {
      const auto run = static_cast<double>(character.count()) * characters;
      return std::max(least, Duration(static_cast<Duration::rep>(run)) + plus);
    }
  };
  Span quiet{};               ///< silence on the line before a request
  Span reply{};               ///< from the end of the request to the first byte of the reply
  Span gap{};                 ///< the longest silence inside a frame
  Span drain{};               ///< after this silence nothing more of an old reply comes
  std::size_t longest = 256;  ///< characters of the longest reply
  int gaps = 2;               ///< the most pauses inside it
  Span longest_time{};        ///< no reply takes longer than this; zero: no such bound

  /// All five times of a line with these settings. Its ceiling is the time for the longest reply.
  config::Timing operator()(const config::SerialSettings& serial) const {
    const Duration character = serial.CharacterTime();
    Duration whole = character * static_cast<Duration::rep>(longest);
    const Duration bound = longest_time.At(character);
    if (bound > Duration::zero()) whole = std::min(whole, bound);
    config::Timing timing;
    timing.quiet = quiet.At(character);
    timing.reply = reply.At(character);
    timing.gap = gap.At(character);
    timing.drain = drain.At(character);
    timing.ceiling = *timing.reply + whole + gaps * *timing.gap;
    return timing;
  }
};

/// What a protocol recognises in bytes that came in place of a reply, for `baudgate status`.
struct Recognised {
  enum class What : std::uint8_t {
    other_device,    ///< a whole reply in the name of another device
    other_master,    ///< a whole request that this gateway has not sent
    other_reply,     ///< a whole reply of the device to another request
    other_setting,   ///< a whole reply, if the device were configured in another way
    other_protocol,  ///< messages of another protocol
    other_form,      ///< a whole line of text, which no telegram that is awaited looks like
    other_check,     ///< whole, but for a check value; `remedy`: how that may be computed, which
                     ///< proves something where it is the same each time
    too_short,       ///< a message that lacks a character or two of its length
  };
  What what = What::other_device;
  std::string cause{};   ///< a sentence without its full stop: "slave 7 answers in its place"
  std::string remedy{};  ///< "set protocol: modbus_rtu at the line"
};

/// Which messages of this protocol are among `heard`, bytes on a line of texts of another protocol,
/// as their check values prove: "messages of Modbus RTU come (slave 4)". Nothing: there are none.
using ForeignRule = std::optional<std::string> (*)(View heard);

/// Telegrams that a person sends by hand (`baudgate ask`). Pure functions.
struct TelegramRule {
  /// The characters that a telegram in text begins with, each of one protocol's only. Empty: its
  /// telegrams are no text.
  std::string_view leads{};
  /// The whole frame of what was typed: the checksum that the device's options want replaces a
  /// final "XX", or is appended if there is none; then comes the end of the line. The error says
  /// what is wrong.
  Result<Bytes> (*complete)(View written, const ParsedOptions& options) = nullptr;
  /// True: every device takes `request`, a whole frame, for a read. False: that is not known.
  bool (*is_read)(View request, const ParsedOptions& options) = nullptr;
};

/// What the devices of one line share, such as a checksum variant that is learned from the replies
/// of all. A protocol derives its own; most have none.
class Bus {
 public:
  virtual ~Bus() = default;
};

/// For protocols that carry Modbus PDUs (a function code and its data): what the gateway needs to
/// pass requests of its clients on to slaves as they are. Pure functions.
struct PduCarrier {
  /// The slave that a device's `address` means, 1…247.
  Result<std::uint8_t> (*slave_of)(std::string_view address) = nullptr;
  /// The whole frame for one slave, or for all (0). `pdu` has 1…253 bytes.
  Bytes (*wrap)(std::uint8_t slave, View pdu) = nullptr;
  /// What the whole reply frame means for `request`, a frame made by wrap. ok: `pdu` is the reply.
  /// refused: `pdu` is the slave's exception. unexpected: length or the repeated part do not fit
  /// the request, and `pdu` is what came; or address or function do not fit, and `pdu` is empty.
  Outcome (*unwrap)(View request, View frame, Bytes& pdu) = nullptr;
  /// Slave and PDU of a whole request frame of a master. Empty: it is not a request.
  std::optional<std::pair<std::uint8_t, Bytes>> (*unwrap_request)(View frame) = nullptr;
  /// Whether every slave answers this PDU, at least with an exception. Silence to any other PDU
  /// does not mean that the slave is absent: it may ignore functions that it does not know.
  bool (*is_common)(View pdu) = nullptr;
  /// The framing of masters that ask the gateway itself: at serial listeners, and of TCP clients at
  /// listeners with this `framing`. For each framing but `tcp` there is one installed protocol;
  /// `tcp` means that this protocol serves no such masters.
  baudgate::modbus::Framing framing = baudgate::modbus::Framing::tcp;
};

/// The address of a device that has none, such as a balance on RS-232.
inline constexpr std::string_view kNoAddress = "none";

struct Protocol {
  std::string_view name{};   ///< "spabus": in configurations, and the name of the module's file
  std::string_view title{};  ///< "ABB SPA Bus, master"
  /// What people call it instead, in lower case, separated by blanks: "spa abb". Only for "did you
  /// mean"; of two that share a word, the one spoken over TCP is meant where the port is a
  /// server's.
  std::string_view also_called{};
  std::span<const OptionSpec> options{};
  std::span<const DecoderSpec> decoders{};

  /// Reads an option of kind `description` and reports all that is wrong with it. The result is
  /// never null, so a description with an error is not taken for none. Null: no option is of that
  /// kind.
  std::shared_ptr<const config::Description> (*describe)(const config::YamlNode& node,
                                                         config::Problems& problems) = nullptr;

  /// One spelling for all spellings of an address: "0x4A" and "74" give "74". Devices of a line
  /// with the same canonical address are the same device. An error says what is wrong and what
  /// would be right. An empty address gives kNoAddress if devices may have none.
  Result<std::string> (*canonical_address)(std::string_view address) = nullptr;
  /// Whether `read`, `write`, type, access and table of a point fit together. An error as above.
  Status (*check_point)(const config::Point& point) = nullptr;
  /// What numbers a point of the device gives. The point has passed check_point, and is no text.
  /// Null: any.
  config::RawNumbers (*raw_numbers)(const config::Device& device,
                                    const config::Point& point) = nullptr;
  /// Whether options and points of the device fit together: options that contradict each other, a
  /// password of the wrong length. Null: nothing is checked.
  Status (*check_device)(const config::Device& device) = nullptr;
  /// The same for single points: an address that its description does not have. A device without an
  /// address stands for a profile: only what is wrong for every device of the profile is reported.
  /// Null: nothing is checked.
  std::vector<ConfigRemark> (*faults)(const config::Device& device) = nullptr;
  /// Warnings for the user. Address and points may be wrong: other checks report that. Null:
  /// nothing is checked.
  std::vector<ConfigRemark> (*doubts)(const config::Device& device) = nullptr;

  /// Used if a line's configuration has no serial settings.
  config::SerialSettings serial{};
  int data_bits = 7;  ///< the fewest that its characters need: 7 or 8
  /// Spoken over TCP connections only (port: tcp://host:port): no serial settings, no echo.
  bool tcp = false;
  TimingRule timing{};

  FrameRule request_rule = nullptr;  ///< cuts requests: for twins, and for masters that are heard
  FrameRule reply_rule = nullptr;    ///< cuts replies
  /// The options of a device or a line, parsed once for all functions below that get ParsedOptions.
  /// Every option that the protocol declares is there. Null: none of these functions needs any.
  ParsedOptions (*parse)(const config::Options& options) = nullptr;
  /// What may answer `request`; for an empty request: what requests look like. Pure.
  Expectation (*expect)(View request, const ParsedOptions& options) = nullptr;
  /// The points of the device that may show something else once `request`, a whole frame, is
  /// carried out. Nothing: that is not known. Null: it is never known. Pure.
  std::optional<std::vector<std::size_t>> (*changes)(View request,
                                                     const config::Device& device) = nullptr;
  /// What `heard`, bytes that came for `request` and are no reply to it, may be. Empty: not known.
  /// Null: it is never known. Pure.
  std::optional<Recognised> (*recognise)(View request, View heard,
                                         const ParsedOptions& options) = nullptr;
  /// For lines of other protocols. Null: nothing proves that a message is one of this protocol.
  ForeignRule foreign = nullptr;

  /// Whether a device with these options sends unasked (Conversation::Listens). It has its line to
  /// itself. Used by the configuration, before options are parsed. Null: no device does.
  bool (*unasked)(const config::Options& options) = nullptr;
  /// The silence of such a device is normal: its values grow old only if it has `max_age`.
  bool never_old = false;

  /// Its replies have no check stronger than an 8-bit sum: at least one in 256 damaged ones looks
  /// whole.
  bool weak_check = false;

  /// What `baudgate status` and `baudgate settings` need to know of its devices.
  config::Traits traits{};

  /// Whether the conversation with this device has a Memory. Null: none has.
  bool (*remembers)(const config::Device& device) = nullptr;
  const ScanRule* scan = nullptr;  ///< null: its devices cannot be looked for
  /// Null: nothing is sent by hand.
  const TelegramRule* telegram = nullptr;
  const PduCarrier* carrier = nullptr;  ///< null: does not carry Modbus PDUs
  /// The protocol whose profiles serve this one as well: "modbus_rtu" of modbus_ascii. Empty: none.
  std::string_view profiles_of{};

  /// Called once for each line, if devices of a line share something; else null.
  std::unique_ptr<Bus> (*make_bus)() = nullptr;
  /// `options` are those of `device`. `device` and `bus` outlive the conversation. `bus` is what
  /// make_bus gave; null without it.
  std::unique_ptr<Conversation> (*make_conversation)(const config::Device& device,
                                                     const ParsedOptions& options,
                                                     Bus* bus) = nullptr;
  /// `device` and `values` outlive the twin.
  std::unique_ptr<Twin> (*make_twin)(const config::Device& device, TwinValues& values) = nullptr;
};

inline bool SpeaksUnasked(const Protocol& protocol, const config::Options& options) {
  return protocol.unasked != nullptr && protocol.unasked(options);
}

inline ParsedOptions ParseOptions(const Protocol& protocol, const config::Options& options) {
  return protocol.parse == nullptr ? ParsedOptions() : protocol.parse(options);
}

/// The `bus` of make_conversation for all devices of one line.
inline std::unique_ptr<Bus> MakeBus(const Protocol& protocol) {
  return protocol.make_bus == nullptr ? nullptr : protocol.make_bus();
}

/// A conversation of a device whose parsed options nobody else needs.
inline std::unique_ptr<Conversation> MakeConversation(const Protocol& protocol,
                                                      const config::Device& device, Bus* bus) {
  return protocol.make_conversation(device, ParseOptions(protocol, device.options), bus);
}

// The number in front of a Modbus TCP frame, another one for each request.

/// Its bytes; 0: frames of this protocol have none.
inline std::size_t TransactionBytes(const Protocol& protocol) { return protocol.tcp ? 2 : 0; }

/// The frame with zeros in place of its number: two requests that ask the same are equal.
inline Bytes WithoutNumber(const Protocol& protocol, View frame) {
  Bytes same(frame.begin(), frame.end());
  std::fill_n(same.begin(), std::min(same.size(), TransactionBytes(protocol)), std::uint8_t{0});
  return same;
}

}  // namespace baudgate::protocols
