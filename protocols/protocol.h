// The contract of protocol plugins. A protocol is one folder of protocols/ and one loadable module.
// The module exports one `Protocol`, a table of texts, data and functions. Read this file first,
// then frame_rule.h, conversation.h and twin.h. docs: protocols/README.md explains how to write a
// protocol.
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

/// A form of `read` that points can use; `baudgate protocols NAME` lists the forms.
struct DecoderSpec {
  std::string_view form{};  ///< an example of the form, such as "I1"
  std::string_view help{};
};

/// A remark on a device's configuration: a fault (Protocol::faults), or an entry that is allowed
/// but probably a mistake (Protocol::doubts).
struct ConfigRemark {
  /// Index of the point concerned; kNoPoint: the remark concerns the device's address.
  std::size_t point = kNoPoint;
  std::string text{};  ///< one sentence with the consequence and the remedy
};

/// The times of a protocol as data, from which the times at any bit rate are computed
/// (docs/timeouts.md).
struct TimingRule {
  /// A time that depends on the bit rate: `least`, or (`characters` character times plus `plus`) if
  /// that is larger. Example: {.least = 5ms, .characters = 7} is 8.02 ms at 9600 bit/s with 11
  /// bits, and 5 ms at 115200 bit/s.
  struct Span {
    Duration least{};
    double characters = 0;
    Duration plus{};

    constexpr Duration At(Duration character) const {
      const auto run = static_cast<double>(character.count()) * characters;
      return std::max(least, Duration(static_cast<Duration::rep>(run)) + plus);
    }
  };
  Span quiet{};  ///< the silence that the line needs before a request
  Span reply{};  ///< maximum time from the end of the request to the first byte of the reply
  Span gap{};    ///< the longest silence inside a frame
  /// After a lost reply: if the line was silent for this time, no more bytes of the reply will
  /// come.
  Span drain{};
  std::size_t longest = 256;  ///< number of characters in the longest reply
  int gaps = 2;         ///< maximum number of pauses as long as `gap` inside the longest reply
  Span longest_time{};  ///< upper bound for the duration of any reply; zero: no bound

  /// Returns the times for a line with these serial settings. The member `ceiling` of the result is
  /// the duration of the longest reply.
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

/// An explanation for bytes that came instead of a reply, for `baudgate status`.
struct Recognised {
  enum class What : std::uint8_t {
    other_device,  ///< a whole reply that carries another device's address
    other_master,  ///< a whole request that this gateway did not send
    other_reply,   ///< a whole reply of the asked device to another request
    /// A reply of a device whose settings, such as checksum, differ from the configured ones.
    other_setting,
    other_protocol,
    other_form,  ///< a whole line of text whose form fits no awaited telegram
    /// A message that is whole except for its check value. `remedy` names the algorithm that gives
    /// the received value. A single message is no proof: several must agree.
    other_check,
    too_short,  ///< a message that is one or two characters too short
  };
  What what = What::other_device;
  std::string cause{};   ///< a sentence without its full stop: "slave 7 answers in its place"
  std::string remedy{};  ///< the change that would help: "set protocol: modbus_rtu at the line"
};

/// Looks for messages of this protocol in `heard`, bytes from a line that runs another, text-based
/// protocol. Returns a phrase such as "messages of Modbus RTU come (slave 4)" if check values prove
/// that they are messages of this protocol, else nothing.
using ForeignRule = std::optional<std::string> (*)(View heard);

/// Functions for telegrams that a person sends by hand (`baudgate ask`). They do no I/O and have no
/// state.
struct TelegramRule {
  /// The characters that can begin a telegram in text form; no two protocols share a character.
  /// Empty: telegrams of this protocol are not text.
  std::string_view leads{};
  /// Makes a whole frame of the typed text and adds the line end. The checksum that the device's
  /// options require replaces a final "XX", or is appended if there is no "XX". The error names the
  /// fault in the text.
  Result<Bytes> (*complete)(View written, const ParsedOptions& options) = nullptr;
  /// True if `request`, a whole frame, is a read for every device of the protocol. False: it may be
  /// a write.
  bool (*is_read)(View request, const ParsedOptions& options) = nullptr;
};

/// State that the devices of one line share, for example a checksum variant that was learned from
/// the replies of all of them. A protocol derives a class from Bus if it needs such a state; most
/// do not.
class Bus {
 public:
  virtual ~Bus() = default;
};

/// The functions by which the gateway forwards clients' requests to slaves unchanged, for protocols
/// that carry Modbus PDUs (a function code and its data). They do no I/O and have no state.
struct PduCarrier {
  /// Returns the slave number, 1…247, for a device's `address`.
  Result<std::uint8_t> (*slave_of)(std::string_view address) = nullptr;
  /// Returns the whole frame with `pdu` (1…253 bytes) for one slave, or for all slaves (0).
  Bytes (*wrap)(std::uint8_t slave, View pdu) = nullptr;
  /// Judges `frame`, a whole reply to `request`, which wrap has made, and sets `pdu`.
  ///   ok          `pdu` is the reply
  ///   refused     `pdu` is the slave's exception
  ///   unexpected  `pdu` is the received PDU if only its length or repeated fields do not fit the
  ///               request; it is empty if the address or the function does not fit
  Outcome (*unwrap)(View request, View frame, Bytes& pdu) = nullptr;
  /// Returns the slave and the PDU of a master's request, a whole frame. Empty: the frame is not a
  /// request.
  std::optional<std::pair<std::uint8_t, Bytes>> (*unwrap_request)(View frame) = nullptr;
  /// True if every slave answers this PDU, at least with an exception. A slave may ignore other
  /// PDUs because it does not implement their function, so its silence does not prove that it is
  /// absent.
  bool (*is_common)(View pdu) = nullptr;
  /// The framing for which the gateway uses this protocol to receive requests of masters: at serial
  /// listeners, and from TCP clients at listeners with this `framing`. Exactly one installed
  /// protocol has each framing except `tcp`; `tcp` means that this protocol receives no requests.
  baudgate::modbus::Framing framing = baudgate::modbus::Framing::tcp;
};

/// The canonical address of a device that has no address, such as a balance on RS-232.
inline constexpr std::string_view kNoAddress = "none";

/// The descriptor of one protocol. All texts and pointers stay valid until the program ends.
struct Protocol {
  std::string_view name{};   ///< "spabus": the name in configurations, and of the module's file
  std::string_view title{};  ///< the name for people: "ABB SPA Bus, master"
  /// Other names that people use, in lower case, separated by blanks: "spa abb". They serve "did
  /// you mean" hints only. If two protocols share a word, the TCP protocol is suggested for a port
  /// tcp://HOST:502, else the serial one.
  std::string_view also_called{};
  std::span<const OptionSpec> options{};
  std::span<const DecoderSpec> decoders{};

  /// Parses an option of kind `description` and reports all its errors to `problems`. If there are
  /// errors, the result is a description without contents, never null: the option was set, although
  /// badly. A null function pointer: the protocol has no option of this kind.
  std::shared_ptr<const config::Description> (*describe)(const config::YamlNode& node,
                                                         config::Problems& problems) = nullptr;

  /// Returns the canonical spelling of an address: "0x4A" and "74" give "74". Devices of a line
  /// with equal canonical addresses are the same device. The error names the fault and a valid
  /// form. An empty address gives kNoAddress if devices of the protocol need no address.
  Result<std::string> (*canonical_address)(std::string_view address) = nullptr;
  /// Checks that `read`, `write`, type, access and table of a point fit together. The error names
  /// the fault and a valid form.
  Status (*check_point)(const config::Point& point) = nullptr;
  /// Returns the range of raw numbers that the point can have. The point has passed check_point and
  /// is not of type text. A null pointer: any number is possible.
  config::RawNumbers (*raw_numbers)(const config::Device& device,
                                    const config::Point& point) = nullptr;
  /// Checks that the options and points of a device fit together. Examples of errors: options that
  /// contradict each other, a password of the wrong length. A null pointer: there is nothing to
  /// check.
  Status (*check_device)(const config::Device& device) = nullptr;
  /// Returns errors of single points, for example an address that the device's description does not
  /// contain. For a profile, which is a device without an address, it returns only the errors that
  /// every device of the profile has. A null pointer: there is nothing to check.
  std::vector<ConfigRemark> (*faults)(const config::Device& device) = nullptr;
  /// Returns warnings for the user. The address and the points may be invalid; other checks report
  /// their errors. A null pointer: there is nothing to warn of.
  std::vector<ConfigRemark> (*doubts)(const config::Device& device) = nullptr;

  /// The serial settings of a line whose configuration has none.
  config::SerialSettings serial{};
  /// The minimum number of data bits that the protocol's characters need: 7 or 8.
  int data_bits = 7;
  /// True: the protocol runs over TCP connections only (port: tcp://host:port), without serial
  /// settings and echo.
  bool tcp = false;
  TimingRule timing{};

  /// Cuts requests out of received bytes, for simulated devices and for requests of other masters.
  FrameRule request_rule = nullptr;
  FrameRule reply_rule = nullptr;
  /// Parses the options of a device or a line once, for all functions below that take
  /// ParsedOptions. `options` contains every option that the protocol declares. A null pointer:
  /// none of these functions needs options.
  ParsedOptions (*parse)(const config::Options& options) = nullptr;
  /// Returns the expected replies to `request`. For an empty `request` it describes the requests
  /// that a device can get. The result depends on the arguments alone.
  Expectation (*expect)(View request, const ParsedOptions& options) = nullptr;
  /// Returns the indices of the device's points whose values can change when `request`, a whole
  /// frame, is carried out. Empty optional: the effect of this request is unknown. A null pointer:
  /// the effect of every request is unknown.
  std::optional<std::vector<std::size_t>> (*changes)(View request,
                                                     const config::Device& device) = nullptr;
  /// Explains `heard`, bytes that came after `request` but are not a reply to it. Empty: there is
  /// no explanation. A null pointer: the protocol explains nothing.
  std::optional<Recognised> (*recognise)(View request, View heard,
                                         const ParsedOptions& options) = nullptr;
  /// Finds messages of this protocol on lines of other protocols. A null pointer: no message of
  /// this protocol can be recognised with certainty.
  ForeignRule foreign = nullptr;

  /// True if a device with these options sends without a request (Conversation::Listens). The
  /// device must then be alone on its line. Called by the checks of the configuration, before
  /// options are parsed. A null pointer: no device of the protocol sends without a request.
  bool (*unasked)(const config::Options& options) = nullptr;
  /// True: silence of a device that sends unasked is normal, so its values become old only if
  /// `max_age` is set.
  bool never_old = false;

  /// True: the check value of replies is at most an 8-bit sum, so one in 256 damaged replies, or
  /// more, looks undamaged.
  bool weak_check = false;

  /// Properties of the devices that `baudgate status` and `baudgate settings` use.
  config::Traits traits{};

  /// True if the conversation with this device uses Conversation::Memory. A null pointer: no
  /// conversation of the protocol uses it.
  bool (*remembers)(const config::Device& device) = nullptr;
  const ScanRule* scan = nullptr;  ///< null: `baudgate scan` cannot search for devices
  /// Functions for `baudgate ask`; null: the protocol does not support this command.
  const TelegramRule* telegram = nullptr;
  const PduCarrier* carrier = nullptr;  ///< null: the protocol does not carry Modbus PDUs
  /// The protocol whose profiles also fit this protocol. Example: "modbus_rtu" for modbus_ascii.
  /// Empty: no other protocol's profiles fit.
  std::string_view profiles_of{};

  /// Makes the Bus of a line; called once for each line. A null pointer: the devices of a line
  /// share no state.
  std::unique_ptr<Bus> (*make_bus)() = nullptr;
  /// Makes the conversation with `device`. `options` are the parsed options of `device`; `bus`
  /// comes from make_bus and is null if make_bus is null. `device` and `bus` outlive the
  /// conversation.
  std::unique_ptr<Conversation> (*make_conversation)(const config::Device& device,
                                                     const ParsedOptions& options,
                                                     Bus* bus) = nullptr;
  /// Makes a simulated device. `device` and `values` must outlive it.
  std::unique_ptr<Twin> (*make_twin)(const config::Device& device, TwinValues& values) = nullptr;
};

inline bool SpeaksUnasked(const Protocol& protocol, const config::Options& options) {
  return protocol.unasked != nullptr && protocol.unasked(options);
}

inline ParsedOptions ParseOptions(const Protocol& protocol, const config::Options& options) {
  return protocol.parse == nullptr ? ParsedOptions() : protocol.parse(options);
}

/// Makes the state that all devices of one line share. It is passed to make_conversation; null if
/// the protocol needs none.
inline std::unique_ptr<Bus> MakeBus(const Protocol& protocol) {
  return protocol.make_bus == nullptr ? nullptr : protocol.make_bus();
}

inline std::unique_ptr<Conversation> MakeConversation(const Protocol& protocol,
                                                      const config::Device& device, Bus* bus) {
  return protocol.make_conversation(device, ParseOptions(protocol, device.options), bus);
}

// Each Modbus TCP request begins with a transaction number, which differs from that of every other
// request.

/// Returns the size of the transaction number in bytes; 0: frames of this protocol have no number.
inline std::size_t TransactionBytes(const Protocol& protocol) { return protocol.tcp ? 2 : 0; }

/// Returns the frame with its transaction number set to zero, so that requests with equal content
/// compare equal.
inline Bytes WithoutNumber(const Protocol& protocol, View frame) {
  Bytes same(frame.begin(), frame.end());
  std::fill_n(same.begin(), std::min(same.size(), TransactionBytes(protocol)), std::uint8_t{0});
  return same;
}

}  // namespace baudgate::protocols
