// The contract of scans: the requests that `baudgate scan` sends on an unknown bus, and the meaning
// of the replies. The scan sends nothing else. A rule contains only requests that no device of any
// protocol, in any mode, treats as a write; devices of the protocol ScanRule::never_at are the only
// exception. Used by gateway/tools/scan.
//
//   Ask(1, mode 0, question 0)  → "$01M\r"        what is your name?
//   Judge(…, "!017017\r")       → a device, "7017"
//
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate::protocols {

/// A setting of devices that decides how they answer. It is given as the option that the
/// configuration needs for such a device. Empty key: all options have their defaults.
struct ScanMode {
  std::string_view key{};    ///< the option, for example "checksum"
  std::string_view value{};  ///< value of the option, for example "true"
};

struct Sighting {
  enum class What : std::uint8_t {
    nothing,  ///< the frame proves no device of this protocol
    maybe,    ///< the frame looks like the request itself, so it may be an echo
    device,
  };
  What what = What::nothing;
  std::string identity{};  ///< the name that the device reports; empty: it reports no name
  std::vector<std::string>
      names{};  ///< names by which a profile can list the device, including `identity`
  /// A point that every such device has, as a line of a configuration, for devices without a
  /// profile. Empty: there is no such point.
  std::string point{};
};

struct ScanRule {
  /// Serial settings that devices of this protocol can have, the most common setting first.
  std::span<const config::SerialSettings> serials{};
  unsigned first_address = 1;
  unsigned last_address = 255;
  std::span<const ScanMode> modes{};  ///< the most common mode first; at least one
  std::size_t quick_modes = 1;        ///< how many modes a quick scan tries
  /// The number of requests (questions) that the rule knows for one address. They are sent in
  /// order. After the first answer the device is known to be present, and the others are sent to
  /// learn its name.
  std::size_t questions = 1;
  /// Bit masks of questions, bit 0 for the first. They select the questions for an address that has
  /// not answered yet: `finds` those that can find a device, `quick_finds` those of a quick scan.
  std::uint32_t finds = 1;
  std::uint32_t quick_finds = 1;
  /// The protocol for which one of the questions would be a write. Devices of that protocol are
  /// searched for first and get no question of this protocol. Empty: no question is a write for any
  /// protocol.
  std::string_view never_at{};
  Duration usual{};  ///< most devices begin their reply within this time
  /// The profile for devices that report their type only with a password.
  std::string_view assumed_profile{};

  Bytes (*ask)(unsigned address, std::size_t mode, std::size_t question) = nullptr;
  /// Judges `frame`, which the reply rule has cut after `request`. The result depends on the
  /// arguments alone.
  Sighting (*judge)(View request, View frame, std::size_t mode) = nullptr;
};

}  // namespace baudgate::protocols
