// The plan of a scan is a list of sweeps, the most likely first. These functions make it from a
// `Wish` of the user; gateway/tools/scan/scanner.h executes the sweeps. No I/O, no clock.
//
//   spabus 9600 7E1 1…32, dcon 9600 8N1 1…32, set4tm 9600 8O1 1…32, …, spabus 4800 7E1 1…32, …
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "config/model/serial.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"

namespace baudgate::scan {

struct Tongue {
  const protocols::Protocol* protocol = nullptr;
  /// The protocol's options for each of ScanRule::modes.
  std::vector<protocols::ParsedOptions> options{};

  const protocols::ScanRule& rule() const { return *protocol->scan; }
};
/// Returns `protocol` and its options. `protocol.scan` must not be null.
Tongue TongueOf(const protocols::Protocol& protocol);

struct Addresses {
  unsigned first = 0;
  unsigned last = 0;  ///< inclusive
  bool operator==(const Addresses&) const = default;
};
/// Parses "1-32" or "7".
Result<Addresses> ParseAddresses(std::string_view text);

struct Wish {
  std::vector<Tongue> tongues{};
  std::optional<Addresses> addresses{};  ///< empty: the usual addresses first, then all addresses
  bool quick = false;                    ///< true: the scan takes less than a minute
  bool network = false;  ///< true: the port is a serial server, whose settings are fixed
};

/// A range of addresses of one protocol, with one setting of the port.
struct Sweep {
  std::size_t tongue = 0;
  config::SerialSettings serial{};
  Addresses addresses{};
  std::size_t modes = 1;    ///< how many of ScanRule::modes to try, from the first
  std::uint32_t finds = 1;  ///< bit mask of the questions to send, see ScanRule::finds
  Duration patience{};      ///< timeout until the first byte of a reply
};

Duration TimeOf(const Sweep& sweep, const Wish& wish);
Duration TimeOf(std::span<const Sweep> sweeps, const Wish& wish);

/// Returns sweeps over the most likely settings and addresses, with short timeouts. A quick scan
/// has only those that fit into kQuickLimit.
std::vector<Sweep> LikelySweeps(const Wish& wish);
/// Returns sweeps over all wanted addresses with longer timeouts: at each setting in `answered`,
/// and at the first setting of each protocol. Returns none for a quick scan.
std::vector<Sweep> ThoroughSweeps(const Wish& wish,
                                  std::span<const config::SerialSettings> answered);

/// Port settings to listen with before anything is sent, and how long to listen.
struct Listening {
  config::SerialSettings serial{};
  Duration time{};
};
std::vector<Listening> ListenFirst(const Wish& wish);

inline constexpr Duration kQuickLimit = 57s;

/// True if bit rate, data bits, parity and stop bits are equal.
bool SameWire(const config::SerialSettings& a, const config::SerialSettings& b);
/// Returns the other formats at this bit rate that can carry the protocol's characters, those in
/// its ScanRule first. `protocol.scan` must not be null.
std::vector<config::SerialSettings> OtherFormats(const config::SerialSettings& serial,
                                                 const protocols::Protocol& protocol);

}  // namespace baudgate::scan
