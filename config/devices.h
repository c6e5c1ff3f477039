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
  const Pace& pace;  ///< the settings for polling of the line, completed by those of the gateway
  const Options& options;               ///< options of scope line that the line sets
  const protocols::Protocol* protocol;  ///< null if the line's protocol was not found
  LineAddresses& addresses;
};

/// Returns the default of `recheck`: `jump` if the replies have a weak check value
/// (Protocol::weak_check) and no parity, else `off`.
Recheck DefaultRecheck(const protocols::Protocol& protocol, const SerialSettings& serial);

/// True if a device with this protocol and these options sends without requests, and only now and
/// then, so that its silence is normal.
bool IsNeverOld(const protocols::Protocol& protocol, const Options& options);

Device ReadDevice(const YamlNode& node, const LineContext& of, LoadContext& context);

}  // namespace baudgate::config
