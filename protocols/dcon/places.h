// Where the values of a module's points stand: their addresses, parsed once, and the requests that
// read them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/query_plan.h"
#include "protocols/dcon/output_group.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/probing.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

/// Each list is by point; nothing where a point is not read or not written.
struct Places {
  Places(const config::Device& device, const Settings& settings);

  /// How many values the reply to `command` has, by options and points; 0: nothing says so.
  std::size_t ChannelsOf(std::string_view command, const Settings& settings) const;
  /// The form of the reply to `command`, if a point reads it.
  std::optional<Form> FormOf(std::string_view command) const;
  /// A point is written with the command, and is no output.
  bool IsSetting(std::string_view command) const;

  Probing::Reads reads;
  std::vector<std::optional<WriteAddress>> writes;
  GroupedOutputs outputs;
};

/// One request for each command, however many points it serves.
QueryPlan<Read> MakePlan(const config::Device& device, const Places& places);

}  // namespace baudgate::protocols::dcon
