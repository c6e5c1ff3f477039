// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/line_twins.h"

#include <algorithm>

namespace baudgate {
namespace {

/// True if one frame rule finds the requests to devices with options `a` and to devices with
/// options `b`. Example: false for two DCON modules of which one has its checksum on. Descriptions
/// of telegrams are compared by their options, because each parse makes frame forms of its own.
bool AreCutAlike(const Protocol& protocol, const config::Options& a, const config::Options& b) {
  return a == b || protocol.expect({}, ParseOptions(protocol, a)) ==
                       protocol.expect({}, ParseOptions(protocol, b));
}

}  // namespace

Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options) {
  std::vector<TwinGroup> groups;
  for (const config::Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol == nullptr) return Error{"protocol " + device.protocol + " is not installed"};
    // A group hears only the requests that its first device's options find.
    const auto same = std::ranges::find_if(groups, [&](const TwinGroup& group) {
      return group.protocol == protocol &&
             AreCutAlike(*protocol, group.devices.front().options, device.options);
    });
    TwinGroup& group = same != groups.end() ? *same : groups.emplace_back(TwinGroup{protocol, {}});
    group.devices.push_back(device);
  }
  if (!line.tcp) options.pace = line.serial;
  options.strict = true;
  return Simulator::Create(io, std::move(groups), options);
}

}  // namespace baudgate
