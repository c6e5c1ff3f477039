// The contract of protocol plugins. A protocol is one folder of protocols/ and one loadable module.
// The module exports one `Protocol`, a table of texts, data and functions. Read this file first,
// then frame_rule.h, conversation.h and twin.h. docs: protocols/README.md explains how to write a
// protocol.
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

/// A form of `read` that points may use, as `baudgate protocols NAME` lists it.
struct DecoderSpec {
  std::string_view form{};  ///< "I1", "float_le@0"
  std::string_view help{};
};

/// A fault of a device's configuration (Protocol::faults), or an entry that is allowed but probably
/// a mistake (Protocol::doubts).
struct ConfigRemark {
  std::size_t point = kNoPoint;  ///< index of the point concerned; kNoPoint: the device's address
  std::string text{};            ///< one sentence: the consequence, and the remedy
};

/// The times of a protocol as data (docs/timeouts.md), for any bit rate of the line.
struct TimingRule {
  /// A time that depends on the bit rate: the larger of `least` and (`characters` character times
  /// plus `plus`). {.least = 5ms, .characters = 7} at 9600 bit/s, 11 bits: 8.02 ms; at 115200: 5
  /// ms.
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
  Span drain{};               ///< after this silence no more bytes of an earlier reply arrive
  std::size_t longest = 256;  ///< characters of the longest reply
  int gaps = 2;               ///< the largest number of pauses inside the longest reply
  Span longest_time{};        ///< upper bound for the duration of any reply; zero: no bound

  /// Returns the times of a line with these settings. `ceiling` is the time for the longest reply.
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

/// The explanation for bytes that came instead of a reply, for `baudgate status`.
struct Recognised {
  enum class What : std::uint8_t {
    other_device,    ///< a whole reply that carries another device's address
    other_master,    ///< a whole request that this gateway did not send
    other_reply,     ///< a whole reply of the asked device to another request
    other_setting,   ///< a whole reply of a device with other settings than the configured ones
    other_protocol,  ///< messages of another protocol
    other_form,      ///< a whole line of text whose form fits no awaited telegram
    other_check,     ///< whole except for its check value; `remedy` gives the algorithm that would
                     ///< produce the value. This is proof only if several messages agree.
    too_short,       ///< a message that is one or two characters too short
  };
  What what = What::other_device;
  std::string cause{};   ///< a sentence without its full stop: "slave 7 answers in its place"
  std::string remedy{};  ///< the change that would help: "set protocol: modbus_rtu at the line"
};

/// Looks for messages of this protocol in `heard`, bytes from a line that runs another, text-based
/// protocol. Returns a phrase such as "messages of Modbus RTU come (slave 4)" if check values prove
/// such messages, else nothing.
using ForeignRule = std::optional<std::string> (*)(View heard);

/// Functions for telegrams that a person sends by hand (`baudgate ask`). All are pure.
struct TelegramRule {
  /// The characters that can begin a telegram in text form; no two protocols share a character.
  /// Empty: telegrams of this protocol are not text.
  std::string_view leads{};
  /// Makes a whole frame of the typed text and adds the line end. The checksum that the device's
  /// options require replaces a final "XX", or is appended if there is no "XX". The error names the
  /// fault in the text.
  Result<Bytes> (*complete)(View written, const ParsedOptions& options) = nullptr;
  /// True if every device treats `request`, a whole frame, as a read. False: it may be a write.
  bool (*is_read)(View request, const ParsedOptions& options) = nullptr;
};

/// State that the devices of one line share, for example a checksum variant learned from the
/// replies of all of them. A protocol derives a class from Bus if it needs one; most do not.
class Bus {
 public:
  virtual ~Bus() = default;
};

/// For protocols that carry Modbus PDUs (a function code and its data): the functions by which the
/// gateway forwards clients' requests to slaves unchanged. All are pure.
struct PduCarrier {
  /// Returns the slave number, 1…247, that a device's `address` stands for.
  Result<std::uint8_t> (*slave_of)(std::string_view address) = nullptr;
  /// Returns the whole frame for one slave, or for all slaves (0). `pdu` has 1…253 bytes.
  Bytes (*wrap)(std::uint8_t slave, View pdu) = nullptr;
  /// Judges a whole reply `frame` to `request`, a frame made by wrap. ok: `pdu` is the reply.
  /// refused: `pdu` is the slave's exception. unexpected: if the length or the repeated fields do
  /// not match the request, `pdu` is the received PDU; if the address or function does not match,
  /// `pdu` is empty.
  Outcome (*unwrap)(View request, View frame, Bytes& pdu) = nullptr;
  /// Returns slave and PDU of a master's whole request frame. Empty: the frame is no request.
  std::optional<std::pair<std::uint8_t, Bytes>> (*unwrap_request)(View frame) = nullptr;
  /// True if every slave answers this PDU, at least with an exception. A slave may ignore other
  /// PDUs because it does not implement their function, so silence to them does not prove that it
  /// is absent.
  bool (*is_common)(View pdu) = nullptr;
  /// The framing that this protocol serves when masters send requests to the gateway: at serial
  /// listeners, and for TCP clients at listeners with this `framing`. Exactly one installed
  /// protocol has each framing except `tcp`; `tcp` means that this protocol serves no masters.
  baudgate::modbus::Framing framing = baudgate::modbus::Framing::tcp;
};

/// The address of a device without an address, such as a balance on RS-232.
inline constexpr std::string_view kNoAddress = "none";

/// The descriptor of one protocol. All texts and pointers stay valid for the life of the program.
struct Protocol {
  std::string_view name{};   ///< "spabus": in configurations, and the name of the module's file
  std::string_view title{};  ///< "ABB SPA Bus, master"
  /// Other names that people use, in lower case, separated by blanks: "spa abb". Only for "did you
  /// mean" hints. If two protocols share a word, the TCP protocol is suggested for a port
  /// tcp://HOST:502, else the serial one.
  std::string_view also_called{};
  std::span<const OptionSpec> options{};
  std::span<const DecoderSpec> decoders{};

  /// Parses an option of kind `description` and reports all its errors to `problems`. The result is
  /// never null, so a description with errors still counts as present. Null: the protocol has no
  /// such option.
  std::shared_ptr<const config::Description> (*describe)(const config::YamlNode& node,
                                                         config::Problems& problems) = nullptr;

  /// Returns the one canonical spelling of an address: "0x4A" and "74" give "74". Devices of a line
  /// with equal canonical addresses are the same device. The error names the fault and a valid
  /// form. An empty address gives kNoAddress if devices need no address.
  Result<std::string> (*canonical_address)(std::string_view address) = nullptr;
  /// Checks that `read`, `write`, type, access and table of a point fit together. The error names
  /// the fault and a valid form.
  Status (*check_point)(const config::Point& point) = nullptr;
  /// Returns the range of raw numbers of a point of the device. The point has passed check_point
  /// and is not of type text. Null: any number is possible.
  config::RawNumbers (*raw_numbers)(const config::Device& device,
                                    const config::Point& point) = nullptr;
  /// Checks that the options and points of a device fit together. Examples of errors: contradicting
  /// options, a password of the wrong length. Null: there is nothing to check.
  Status (*check_device)(const config::Device& device) = nullptr;
  /// Returns errors of single points, for example an address that the device's description does not
  /// contain. A device without an address stands for a profile: then only errors that concern every
  /// device of the profile are returned. Null: there is nothing to check.
  std::vector<ConfigRemark> (*faults)(const config::Device& device) = nullptr;
  /// Returns warnings for the user. Address and points may be invalid; other checks report such
  /// errors. Null: there is nothing to check.
  std::vector<ConfigRemark> (*doubts)(const config::Device& device) = nullptr;

  /// The serial settings of a line whose configuration has none.
  config::SerialSettings serial{};
  int data_bits = 7;  ///< the minimum that the protocol's characters need: 7 or 8
  /// True: the protocol runs over TCP connections only (port: tcp://host:port), without serial
  /// settings and echo.
  bool tcp = false;
  TimingRule timing{};

  /// Cuts requests: for twins, and for requests of other masters.
  FrameRule request_rule = nullptr;
  FrameRule reply_rule = nullptr;  ///< cuts replies
  /// Parses the options of a device or a line once, for all functions below that take
  /// ParsedOptions. `options` contains every option that the protocol declares. Null: none of these
  /// functions needs options.
  ParsedOptions (*parse)(const config::Options& options) = nullptr;
  /// Returns the expected replies to `request`; for an empty request: the form of requests. Pure.
  Expectation (*expect)(View request, const ParsedOptions& options) = nullptr;
  /// Returns the device's points whose values may change when `request`, a whole frame, has been
  /// carried out. Nothing: unknown for this request. Null: unknown for every request. Pure.
  std::optional<std::vector<std::size_t>> (*changes)(View request,
                                                     const config::Device& device) = nullptr;
  /// Explains `heard`, bytes that came after `request` but are no reply to it. Empty: no
  /// explanation. Null: there never is one. Pure.
  std::optional<Recognised> (*recognise)(View request, View heard,
                                         const ParsedOptions& options) = nullptr;
  /// Used on lines of other protocols. Null: no message of this protocol can be recognised with
  /// certainty.
  ForeignRule foreign = nullptr;

  /// True if a device with these options sends without a request (Conversation::Listens). Such a
  /// device must be alone on its line. The configuration calls this before options are parsed.
  /// Null: no device does.
  bool (*unasked)(const config::Options& options) = nullptr;
  /// Silence of a device that sends unasked is normal: its values become old only if `max_age` is
  /// set.
  bool never_old = false;

  /// Replies have at most an 8-bit sum as check value, so one in 256 damaged replies, or more,
  /// looks undamaged.
  bool weak_check = false;

  /// Properties of the devices that `baudgate status` and `baudgate settings` use.
  config::Traits traits{};

  /// True if the conversation with this device uses Memory. Null: no conversation does.
  bool (*remembers)(const config::Device& device) = nullptr;
  const ScanRule* scan = nullptr;  ///< null: `baudgate scan` cannot search for devices
  /// Null: `baudgate ask` cannot be used.
  const TelegramRule* telegram = nullptr;
  const PduCarrier* carrier = nullptr;  ///< null: the protocol does not carry Modbus PDUs
  /// The protocol whose profiles also fit this one: "modbus_rtu" for modbus_ascii. Empty: none.
  std::string_view profiles_of{};

  /// Makes the Bus; called once for each line. Null: devices of a line share nothing.
  std::unique_ptr<Bus> (*make_bus)() = nullptr;
  /// `options` are the parsed options of `device`. `device` and `bus` outlive the conversation.
  /// `bus` comes from make_bus; null if make_bus is null.
  std::unique_ptr<Conversation> (*make_conversation)(const config::Device& device,
                                                     const ParsedOptions& options,
                                                     Bus* bus) = nullptr;
  /// Makes a twin. `device` and `values` must outlive it.
  std::unique_ptr<Twin> (*make_twin)(const config::Device& device, TwinValues& values) = nullptr;
};

inline bool SpeaksUnasked(const Protocol& protocol, const config::Options& options) {
  return protocol.unasked != nullptr && protocol.unasked(options);
}

inline ParsedOptions ParseOptions(const Protocol& protocol, const config::Options& options) {
  return protocol.parse == nullptr ? ParsedOptions() : protocol.parse(options);
}

/// Returns the `bus` argument of make_conversation for all devices of one line; may be null.
inline std::unique_ptr<Bus> MakeBus(const Protocol& protocol) {
  return protocol.make_bus == nullptr ? nullptr : protocol.make_bus();
}

inline std::unique_ptr<Conversation> MakeConversation(const Protocol& protocol,
                                                      const config::Device& device, Bus* bus) {
  return protocol.make_conversation(device, ParseOptions(protocol, device.options), bus);
}

// The transaction number in front of a Modbus TCP frame; each request has another number.

/// Returns the size of the transaction number; 0: frames of this protocol have none.
inline std::size_t TransactionBytes(const Protocol& protocol) { return protocol.tcp ? 2 : 0; }

/// Returns the frame with its transaction number set to zero, so that requests with equal content
/// compare equal.
inline Bytes WithoutNumber(const Protocol& protocol, View frame) {
  Bytes same(frame.begin(), frame.end());
  std::fill_n(same.begin(), std::min(same.size(), TransactionBytes(protocol)), std::uint8_t{0});
  return same;
}

}  // namespace baudgate::protocols
