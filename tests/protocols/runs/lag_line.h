// The lines that run behind a lagging server: which points their devices have, who may take the
// place of a device, and what is said to the request that asks for a name.
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
  two,   ///< two points, each read by a request of its own, both of the same form
  many,  ///< those of the profile, some of them slow and one read once; one can be written where
         ///< the protocol can
};
/// What a device says when it is asked who it is (SPA `RF`, DCON `$AAM`, Modbus 08).
enum class Proof : std::uint8_t { answered, refused, silent };

struct LagCase {
  Setup setup;
  Queries queries = Queries::one;
  Proof proof = Proof::answered;

  std::string name() const;  ///< "Spa9600TwoSilent"
  /// Some request could be answered by nothing else. Without one, order is beyond proof: DCON
  /// modules without a name whose reads have one form (docs/timeouts.md, "The limit").
  bool CanProve() const;
};

inline void PrintTo(const LagCase& which, std::ostream* out) { *out << which.name(); }
inline std::string LagCaseName(const ::testing::TestParamInfo<LagCase>& info) {
  return info.param.name();
}

/// Every real line with every number of queries, and with every proof that its protocol has.
const std::vector<LagCase>& LagCases();
LagCase LagCaseOf(const std::string& line, Queries queries, Proof proof);

/// Polled every 2 s, slow points every 10 s: longer than any reply takes.
config::Line LagLineOf(const LagCase& which);
/// What may take the place of a device: it has its address.
config::Device StrangerOf(const LagCase& which, const config::Device& device, bool other_identity);

/// How a device of another identity can be known.
enum class Naming : std::uint8_t {
  none,
  learned,   ///< its name is another than before
  demanded,  ///< the configuration names it: a serial number
};
Naming NamingOf(const LagCase& which, const config::Device& device);

/// What is said in place of the twin's reply: nothing, the twin's stands; empty, silence.
std::optional<Bytes> SayIdentification(const LagCase& which, const config::Device& device,
                                       View request, bool other_identity);

/// The point of the device that can be written; nothing: none can.
std::optional<std::uint32_t> WritablePoint(const config::Device& device);

}  // namespace baudgate::protocols
