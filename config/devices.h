// `ReadDevice` reads one device of a line. The device's keys take precedence over its profile, the
// profile over line and protocol.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/checks/device_checks.h"
#include "config/lines.h"
#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Returns the protocol that `protocol:` names. If the protocol is not installed, reports a problem
/// and returns the most likely intended protocol, so that the rest can be checked; null if no name
/// is similar. `port` is the line's port.
const protocols::Protocol* ReadProtocol(const YamlNode& node, const std::string& port,
                                        LoadContext& context);

struct LineContext {
  const Line& line;
  const Pace& pace;                     ///< the pace of the line, else of the gateway
  const Options& options;               ///< options of scope line that the line sets
  const protocols::Protocol* protocol;  ///< null if the line's protocol was not found
  LineAddresses& addresses;
};

/// Returns the default of `recheck`: jump, if replies have neither a strong check value nor parity,
/// else off.
Recheck DefaultRecheck(const protocols::Protocol& protocol, const SerialSettings& serial);

/// True if the silence of a device with this protocol and these options is normal.
bool IsNeverOld(const protocols::Protocol& protocol, const Options& options);

Device ReadDevice(const YamlNode& node, const LineContext& of, LoadContext& context);

}  // namespace baudgate::config
