// ReadDevice reads one device of a line. Its own keys win over its profile, and its profile wins
// over its line and protocol. YAML nodes come from config/lines.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/checks/device_checks.h"
#include "config/lines.h"
#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// The protocol that a `protocol:` names. Where it is not installed, a problem and the one that is
/// meant, so that the rest is checked as well; null: none is near. `port`: of the line.
const protocols::Protocol* ReadProtocol(const YamlNode& node, const std::string& port,
                                        LoadContext& context);

/// What a device inherits from its line.
struct LineContext {
  const Line& line;
  const Pace& pace;                     ///< line before gateway
  const Options& options;               ///< those of scope line that the line gives
  const protocols::Protocol* protocol;  ///< null when the line's own could not be found
  LineAddresses& addresses;
};

/// The default of `recheck`: jump, if neither a strong check value nor parity guards replies.
Recheck DefaultRecheck(const protocols::Protocol& protocol, const SerialSettings& serial);

/// Its protocol and its options say whether its silence is normal.
bool IsNeverOld(const protocols::Protocol& protocol, const Options& options);

Device ReadDevice(const YamlNode& node, const LineContext& of, LoadContext& context);

}  // namespace baudgate::config
