// The lines that run behind a lagging server: the points of their devices, the devices that may
// replace them, and the replies to the request for a name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {

/// How many requests read the fast points of a device.
enum class Queries : std::uint8_t {
  one,   ///< one point
  two,   ///< two points, each read by its own request, both of the same form
  many,  ///< the points of the profile, some of them slow and one read once; one is writable if the
         ///< protocol supports it
};
/// The reply of a device to the request for its identity (SPA `RF`, DCON `$AAM`, Modbus 08).
enum class Proof : std::uint8_t { answered, refused, silent };

struct LagCase {
  Setup setup;
  Queries queries = Queries::one;
  Proof proof = Proof::answered;

  std::string name() const;  ///< "Spa9600TwoSilent"
  /// True if some request has a reply that fits no other request. Otherwise the order of replies
  /// cannot be proven, as for DCON modules without a name whose reads have one form
  /// (docs/timeouts.md, "The limit").
  bool CanProve() const;
};

inline void PrintTo(const LagCase& which, std::ostream* out) { *out << which.name(); }
inline std::string LagCaseName(const ::testing::TestParamInfo<LagCase>& info) {
  return info.param.name();
}

/// All combinations of real lines, numbers of queries, and proofs that the protocol supports.
const std::vector<LagCase>& LagCases();
LagCase LagCaseOf(const std::string& line, Queries queries, Proof proof);

/// The poll period is 2 s, or 10 s for slow points: longer than any reply takes.
config::Line LagLineOf(const LagCase& which);
/// A device that may replace `device`, with the same address.
config::Device StrangerOf(const LagCase& which, const config::Device& device, bool other_identity);

enum class Naming : std::uint8_t {
  none,
  learned,   ///< the name differs from the name before
  demanded,  ///< the configuration contains its serial number
};
Naming NamingOf(const LagCase& which, const config::Device& device);

/// The reply instead of the twin's. Nothing: the twin's reply is used; empty: silence.
std::optional<Bytes> SayIdentification(const LagCase& which, const config::Device& device,
                                       View request, bool other_identity);

/// The writable point of the device; nothing: there is none.
std::optional<std::uint32_t> WritablePoint(const config::Device& device);

}  // namespace baudgate::protocols
