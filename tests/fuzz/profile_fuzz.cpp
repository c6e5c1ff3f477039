// Fuzzes the loading of profiles. Input: a byte for the protocol (see ProtocolOf), the YAML text.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "config/points.h"
#include "config/profile.h"
#include "protocols/all_protocols.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

/// Returns the protocol whose name contains the letter `byte`, else the protocol of this number.
const protocols::Protocol& ProtocolOf(std::uint8_t byte) {
  for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
    if (protocol->name.find(static_cast<char>(byte)) != std::string_view::npos) return *protocol;
  }
  return *protocols::AllProtocols()[byte % protocols::AllProtocols().size()];
}

void FuzzProfile(View bytes) {
  Input input(bytes);
  const protocols::Protocol& protocol = ProtocolOf(input.U8());
  const std::string text(AsText(input.Rest()));
  config::Problems problems;
  try {
    config::RawProfile raw = config::ReadProfileText(text, "p.yaml", "p", protocol, problems);
    const auto points = config::BuildPoints(raw.points, &protocol, problems);
    const auto sorted = problems.Sorted();
    for (const config::Problem& problem : sorted) {
      Require(!problem.message.empty() && ToString(problem).find('\n') == std::string::npos,
              "a problem is one line of words");
    }
    if (config::HasError(sorted)) return;
    for (const config::Point& point : points) {
      Require(protocol.check_point(point).ok(), "the protocol takes its points");
    }
    // Allowed, because config/loader.cpp catches exceptions of the YAML library.
  } catch (const YAML::Exception&) {
  }
}

const Registered kProfile("profile", FuzzProfile);

}  // namespace
}  // namespace baudgate::fuzz
