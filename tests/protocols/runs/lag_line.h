// The lines for tests of a lagging server: the points of their devices, the devices that replace
// them, and the replies to the request for a name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {

/// Which requests read the fast points of a device.
enum class Queries : std::uint8_t {
  one,
  two,  ///< two points of the same form, each read by its own request
  /// The points of the profile: some are slow, one is read once, and one is writable if the
  /// protocol supports writing.
  many,
};
/// The reply of a device to the request for its identity (SPA `RF`, DCON `$AAM`, Modbus 08).
enum class Proof : std::uint8_t { answered, refused, silent };

struct LagCase {
  Setup setup;
  Queries queries = Queries::one;
  Proof proof = Proof::answered;

  std::string name() const;
  /// True if some request has a reply that fits no other request. Otherwise the order of replies
  /// cannot be proven (docs/timeouts.md, "The limit").
  bool CanProve() const;
};

inline void PrintTo(const LagCase& which, std::ostream* out) { *out << which.name(); }
inline std::string LagCaseName(const ::testing::TestParamInfo<LagCase>& info) {
  return info.param.name();
}

const std::vector<LagCase>& LagCases();
LagCase LagCaseOf(const std::string& line, Queries queries, Proof proof);

/// Returns a line whose poll period is 2 s, or 10 s for slow points: longer than any reply takes.
config::Line LagLineOf(const LagCase& which);
config::Device StrangerOf(const LagCase& which, const config::Device& device, bool other_identity);

enum class Naming : std::uint8_t {
  none,
  learned,   ///< the gateway learns the name from the device's first replies
  demanded,  ///< the configuration demands a serial number
};
Naming NamingOf(const LagCase& which, const config::Device& device);

/// Returns the reply to a request for the name. Nothing: the simulated device answers itself.
/// Empty: there is no reply.
std::optional<Bytes> SayIdentification(const LagCase& which, const config::Device& device,
                                       View request, bool other_identity);

std::optional<std::uint32_t> WritablePoint(const config::Device& device);

}  // namespace baudgate::protocols
