// The contract of scans: what `baudgate scan` may ask on an unknown bus, and what the replies mean.
// Nothing else is ever sent there. A rule lists only requests that no device of any protocol, in
// any mode, takes for a write. Applied by gateway/tools/scan.
//
//   Ask(1, mode 0, question 0)  → "$01M\r"        what is your name?
//   Judge(…, "!017017\r")       → a device, "7017"
//
// SPDX-License-Identifier: Apache-2.0
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

/// A setting of devices of the protocol that decides how they answer, and the option that the
/// configuration needs for it. No key: the options' defaults.
struct ScanMode {
  std::string_view key{};    ///< "checksum"
  std::string_view value{};  ///< "true"
};

/// What a whole frame says about its sender.
struct Sighting {
  enum class What : std::uint8_t {
    nothing,  ///< no device of this protocol is proven by it
    maybe,    ///< the request itself would look alike
    device,
  };
  What what = What::nothing;
  std::string identity{};  ///< its name for itself; empty: it has none
  std::vector<std::string>
      names{};  ///< names under which profiles may list it; the identity is one of them
  /// A point that any such device has, as a line of a configuration. For devices without a profile.
  /// Empty: there is none.
  std::string point{};
};

struct ScanRule {
  /// Settings that its devices have, the usual ones first.
  std::span<const config::SerialSettings> serials{};
  unsigned first_address = 1;
  unsigned last_address = 255;
  std::span<const ScanMode> modes{};  ///< the usual one first; at least one
  std::size_t quick_modes = 1;        ///< how many of them are tried if time is short
  /// The questions, in their order. A device that has answered one of them is there; the others are
  /// then asked for its name.
  std::size_t questions = 1;
  /// Which of them a silent address is asked, as bits: all that may find a device, and those used
  /// if time is short.
  std::uint32_t finds = 1;
  std::uint32_t quick_finds = 1;
  /// A protocol for which one of the questions would be a write: its devices are found first, and
  /// then never asked. Empty: there is none.
  std::string_view never_at{};
  Duration usual{};  ///< most devices begin to answer within this time
  /// For devices that report their type only with a password.
  std::string_view assumed_profile{};

  Bytes (*ask)(unsigned address, std::size_t mode, std::size_t question) = nullptr;
  /// `frame`: cut by the reply rule for `request`. Pure.
  Sighting (*judge)(View request, View frame, std::size_t mode) = nullptr;
};

}  // namespace baudgate::protocols
