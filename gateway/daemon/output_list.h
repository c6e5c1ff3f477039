// `AllOutputs` lists the outputs of this gateway, one row each. All other code in this folder uses
// outputs only through the interface Output (gateway/outputs/output.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/lines/line_control.h"
#include "gateway/outputs/output.h"

namespace baudgate::lines {
class Lines;
}  // namespace baudgate::lines

namespace baudgate::records {
class Records;
}  // namespace baudgate::records

namespace baudgate::status {
struct GatewayInfo;
}  // namespace baudgate::status

namespace baudgate::daemon {

class Reloader;

/// The parts of the gateway that an output can use. They outlive the output.
struct OutputLinks {
  const config::Config& config;  ///< the configuration of the start
  const config::Catalog& catalog;
  bus::PointStore& store;
  lines::Lines& lines;
  lines::LineControl& control;
  bus::CommandSink& commands;
  records::Records& records;
  Reloader* reloader;  ///< null: the gateway cannot be reloaded
  /// valid only while the output is made, so the output must copy it
  const status::GatewayInfo& info;
  /// Returns the descriptors that the whole gateway needs.
  std::function<outputs::DescriptorNeeds(const config::Config& config)> needs;
};

struct OutputRow {
  std::function<std::unique_ptr<outputs::Output>(const OutputLinks& links)> make;
  /// Returns the descriptors that the output needs. Empty: kForGateway
  /// (gateway/daemon/descriptors.cpp) contains them.
  std::function<outputs::DescriptorNeeds(const config::Config& config)> descriptors{};
  /// Returns the name under which the output stores how far it has read the events
  /// (events::CursorBook). Empty: the output stores no such name.
  std::function<std::string(const config::Config& config)> consumer{};
};
using OutputRows = std::vector<OutputRow>;

/// Returns the outputs in the order in which they start and stop: outputs through which people and
/// clients write come first. Modbus comes before DDS, because a second gateway on this machine
/// fails at the Modbus port. So it fails before it publishes the points of the first gateway and
/// then reports their end.
OutputRows AllOutputs();

}  // namespace baudgate::daemon
