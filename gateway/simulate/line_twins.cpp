// SPDX-License-Identifier: Apache-2.0
#include "gateway/simulate/line_twins.h"

#include <algorithm>

namespace baudgate {

Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options) {
  std::vector<TwinGroup> groups;
  for (const config::Device& device : line.devices) {
    const Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol == nullptr) return Error{"protocol " + device.protocol + " is not installed"};
    // Whose telegrams are described are told from others by their descriptions.
    const auto same = std::ranges::find_if(groups, [&](const TwinGroup& group) {
      return group.protocol == protocol &&
             (protocol->describe == nullptr || group.devices.front().options == device.options);
    });
    TwinGroup& group = same != groups.end() ? *same : groups.emplace_back(TwinGroup{protocol, {}});
    group.devices.push_back(device);
  }
  if (!line.tcp) options.pace = line.serial;
  options.strict = true;
  return Simulator::Create(io, std::move(groups), options);
}

}  // namespace baudgate
