// What a scan asks, where and in which order: a list of sweeps, the most likely first. Pure; from
// the wish of the user to gateway/tools/scan/scanner.h, which carries it out.
//
//   spabus 9600 7E1 1…32, dcon 9600 8N1 1…32, set4tm 9600 8O1 1…32, …, spabus 4800 7E1 1…32, …
//
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

/// A protocol that is looked for.
struct Tongue {
  const protocols::Protocol* protocol = nullptr;
  std::vector<protocols::ParsedOptions> options{};  ///< by mode of its rule

  const protocols::ScanRule& rule() const { return *protocol->scan; }
};
/// `protocol` has a ScanRule.
Tongue TongueOf(const protocols::Protocol& protocol);

struct Addresses {
  unsigned first = 0;
  unsigned last = 0;  ///< included
  bool operator==(const Addresses&) const = default;
};
/// "1-32" or "7".
Result<Addresses> ParseAddresses(std::string_view text);

struct Wish {
  std::vector<Tongue> tongues{};
  std::optional<Addresses> addresses{};  ///< empty: the usual ones first, then all
  bool quick = false;                    ///< the whole scan takes less than a minute
  bool network = false;                  ///< a serial server has the settings
};

/// Addresses of one protocol with one setting of the port.
struct Sweep {
  std::size_t tongue = 0;
  config::SerialSettings serial{};
  Addresses addresses{};
  std::size_t modes = 1;    ///< the first ones of the rule
  std::uint32_t finds = 1;  ///< questions, as bits
  Duration patience{};      ///< until the first byte of a reply
};

/// How long the sweep takes if no device answers.
Duration TimeOf(const Sweep& sweep, const Wish& wish);
Duration TimeOf(std::span<const Sweep> sweeps, const Wish& wish);

/// The most likely settings and addresses, each in short time.
std::vector<Sweep> LikelySweeps(const Wish& wish);
/// All addresses, with more patience: where something has answered, and with the first setting of
/// each protocol. Empty where time is short.
std::vector<Sweep> ThoroughSweeps(const Wish& wish,
                                  std::span<const config::SerialSettings> answered);

/// Settings with which it is listened before anything is sent, and for how long each.
struct Listening {
  config::SerialSettings serial{};
  Duration time{};
};
std::vector<Listening> ListenFirst(const Wish& wish);

/// A quick scan ends then.
inline constexpr Duration kQuickLimit = 57s;

/// Same bit rate and format.
bool SameWire(const config::SerialSettings& a, const config::SerialSettings& b);
/// The other formats of the same bit rate that the protocol's characters fit into, those first that
/// its devices usually have. `protocol` has a ScanRule.
std::vector<config::SerialSettings> OtherFormats(const config::SerialSettings& serial,
                                                 const protocols::Protocol& protocol);

}  // namespace baudgate::scan
