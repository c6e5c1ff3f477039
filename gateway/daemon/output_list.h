// The outputs of this gateway. AllOutputs is the list that names them, one row each; everything
// else in this folder knows them only as Output (gateway/outputs/output.h).
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

/// What an output may be joined with. All of it outlives the output.
struct OutputLinks {
  const config::Config& config;  ///< of the start
  const config::Catalog& catalog;
  bus::PointStore& store;
  lines::Lines& lines;
  lines::LineControl& control;
  bus::CommandSink& commands;  ///< that writes go to
  records::Records& records;
  Reloader* reloader;               ///< null: nothing is reloaded
  const status::GatewayInfo& info;  ///< to be copied
  /// Of the whole gateway.
  std::function<outputs::DescriptorNeeds(const config::Config& config)> needs;
};

struct OutputRow {
  std::function<std::unique_ptr<outputs::Output>(const OutputLinks& links)> make;
  /// Empty: no more than a few.
  std::function<outputs::DescriptorNeeds(const config::Config& config)> descriptors{};
  /// Its name in the file of the events that outputs have got (events::CursorBook), if it keeps its
  /// place there.
  std::function<std::string(const config::Config& config)> consumer{};
};
using OutputRows = std::vector<OutputRow>;

/// They stop in this order: first those through which people and clients write. Modbus stands
/// before DDS, because its port is the one that is taken when a gateway is started twice: the
/// second gateway must not publish, and then end, the points of the first.
OutputRows AllOutputs();

}  // namespace baudgate::daemon
