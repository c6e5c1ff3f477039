// The contract of protocol plugins: one loadable module per protocol, one C symbol that returns its
// descriptor. docs: protocols/README.md, "How to add a protocol".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "config/model/line.h"
#include "gateway/base/result.h"
#include "protocols/conversation.h"
#include "protocols/frame_rule.h"
#include "protocols/twin.h"

namespace baudgate {

/// Raised whenever a struct or class of this header, or one it includes, changes.
inline constexpr std::uint32_t kProtocolInterfaceVersion = 4;

#define BAUDGATE_STRING_(x) #x
#define BAUDGATE_STRING(x) BAUDGATE_STRING_(x)
/// Compiler and standard library ABI that a module must share with the daemon.
#define BAUDGATE_ABI_TAG \
  "gcc" BAUDGATE_STRING(__GNUC__) "-cxxabi" BAUDGATE_STRING(__GXX_ABI_VERSION)

/// One key that a protocol adds to devices or lines in the configuration.
struct OptionSpec {
  enum class Kind : std::uint8_t { flag, integer, real, text, duration, choice, texts };
  enum class Scope : std::uint8_t { device, line };
  std::string_view name;
  Kind kind = Kind::text;
  std::string_view fallback;  ///< as the user would write it; texts: separated by commas
  std::string_view help;      ///< one sentence
  Scope scope = Scope::device;
  double minimum = 0;  ///< of integer and real, when minimum < maximum
  double maximum = 0;
  std::string_view choices = {};  ///< of choice, separated by commas
  bool secret = false;            ///< never shown in logs, `check` or `map`
};

/// A way to read a point, for `baudgate protocols NAME` and for messages.
struct DecoderSpec {
  std::string_view form;  ///< "I1", "float_le@0"
  std::string_view help;
};

/// One per line and protocol: what the devices of a line share, and the maker of conversations.
class Bus {
 public:
  virtual ~Bus() = default;
  /// `device` outlives the conversation.
  virtual std::unique_ptr<Conversation> MakeConversation(const config::Device& device) = 0;
};

/// For protocols that carry Modbus PDUs (function code and data): what transparent routes need.
/// Pure functions.
struct PduCarrier {
  /// The slave that a device's `address` means, 1…247.
  Result<std::uint8_t> (*slave_of)(std::string_view address) = nullptr;
  /// The whole frame for one slave, or for all (0). `pdu` has 1…253 bytes.
  Bytes (*wrap)(std::uint8_t slave, View pdu) = nullptr;
  /// What a whole reply frame says to `request` (made by wrap): ok with the reply's PDU; refused
  /// with the PDU of the slave's exception; unexpected, without one, when address, function, length
  /// or what a reply repeats of its request do not fit.
  Outcome (*unwrap)(View request, View frame, Bytes& pdu) = nullptr;
  /// The request inside a whole frame that a master sent: slave and PDU. Nothing when it is none.
  std::optional<std::pair<std::uint8_t, Bytes>> (*unwrap_request)(View frame) = nullptr;
  /// Whether every slave answers this request, if only with an exception: one that is in general
  /// use and well-formed. Silence to any other says nothing about the slave.
  bool (*is_common)(View pdu) = nullptr;
  /// Whether the frames are those of Modbus RTU: listeners with `protocol: rtu` need them.
  bool rtu_frames = false;
};

struct Protocol {
  std::uint32_t interface_version = kProtocolInterfaceVersion;  // first: read before all else
  const char* abi_tag = BAUDGATE_ABI_TAG;
  std::string_view name;   ///< "spabus": in the configuration and as the module's file name
  std::string_view title;  ///< "ABB SPA Bus, master"
  std::span<const OptionSpec> options;
  std::span<const DecoderSpec> decoders;

  /// An error says what is wrong and what would be right.
  Status (*check_address)(std::string_view address) = nullptr;
  /// Whether `point.read`, `point.write`, type and table fit together.
  Status (*check_point)(const config::Point& point) = nullptr;
  /// What only the whole device shows: options that contradict each other, a malformed password.
  /// May be left out.
  Status (*check_device)(const config::Device& device) = nullptr;

  /// Used where a line's configuration gives no serial settings.
  config::SerialSettings serial;
  /// The fewest that its characters need: 7 or 8.
  int data_bits = 7;
  /// All six times for a line of these settings; every field is set.
  config::Timing (*timing)(const config::SerialSettings& serial) = nullptr;

  FrameRule request_rule = nullptr;
  FrameRule reply_rule = nullptr;
  /// What may answer `request`; an empty request asks for the Expectation that goes with
  /// request_rule. Pure.
  Expectation (*expect)(View request, const config::Options& options) = nullptr;

  /// Null where the protocol does not carry Modbus.
  const PduCarrier* carrier = nullptr;
  /// The protocol whose profiles serve this one as well; empty: none does.
  std::string_view profiles_of = {};

  std::unique_ptr<Bus> (*make_bus)(const config::Line& line) = nullptr;
  /// `device` and `values` outlive the twin.
  std::unique_ptr<Twin> (*make_twin)(const config::Device& device, TwinValues& values) = nullptr;
};

}  // namespace baudgate

/// What every module exports. The daemon never unloads a module, so the descriptor lives for ever.
extern "C" const baudgate::Protocol* baudgate_protocol();
