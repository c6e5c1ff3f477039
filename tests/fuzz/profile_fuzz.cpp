// Any text as a device profile, of each protocol in turn.
// Input: one byte for the protocol ('d', 's', 'm', 'r'; others: by its number), then the YAML text.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "config/points.h"
#include "config/profile.h"
#include "protocols/dcon/protocol.h"
#include "protocols/modbus/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"
#include "tests/fuzz/fuzz.h"

namespace baudgate::fuzz {
namespace {

const Protocol& ProtocolOf(std::uint8_t byte) {
  switch (byte) {
    case 'd':
      return DconProtocol();
    case 's':
      return SpabusProtocol();
    case 'm':
      return Set4tmProtocol();
    case 'r':
      return ModbusRtuProtocol();
    default:
      return byte % 2 == 0 ? DconProtocol() : Set4tmProtocol();
  }
}

}  // namespace
}  // namespace baudgate::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace baudgate;
  using namespace baudgate::fuzz;
  Input input(data, size);
  const Protocol& protocol = ProtocolOf(input.U8());
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
    if (config::HasError(sorted)) return 0;
    for (const config::Point& point : points) {
      Require(protocol.check_point(point).ok(), "the protocol takes its points");
    }
  } catch (const YAML::Exception&) {  // ends at the edge in config/loader.cpp
  }
  return 0;
}
