// `baudgate watch`: shows what gateways publish on DDS, as a live table, text or JSON lines.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "config/model/network.h"
#include "gateway/base/time.h"
#include "gateway/tools/terminal/live_table.h"

namespace baudgate::dds {
struct ParticipantOptions;
}  // namespace baudgate::dds

namespace baudgate::tools {

struct WatchOptions {
  int domain = 0;
  std::vector<std::string> interfaces = {"127.0.0.1"};
  /// See config::SecurityIn; empty: no security.
  std::string security;
  std::vector<std::string> peers;                     ///< see dds::ParticipantOptions
  std::vector<config::HostPort> discovery_servers{};  ///< see dds::ParticipantOptions
  bool multicast = true;                              ///< see dds::ParticipantOptions
  bool once = false;                ///< wait until no new point comes, print all, end
  bool events = false;              ///< instead of points
  bool alarms = false;              ///< instead of points
  bool json = false;                ///< one object for each reading
  std::optional<Duration> seconds;  ///< empty: at SIGINT, SIGTERM or SIGHUP
  std::string gateway;              ///< empty: all gateways
  std::string device;
  std::string point;
  std::string point_order;  ///< for PointOrder; empty: points are sorted by name
  /// Set: a live table instead of text lines; see TerminalView.
  std::optional<TableView> terminal;
  Duration first_sample_timeout = 10s;  ///< how long `once` waits
};

dds::ParticipantOptions ParticipantOf(const WatchOptions& options);

/// Exit codes: 0; 2 for `multicast` false without peers and discovery servers; 4 no point was
/// received, or the subscriber cannot be created.
int RunWatch(const WatchOptions& options, std::ostream& out, std::ostream& err);

// The gateway's program passes these options on to baudgate-dds.

/// `options` must stay valid until parsing has ended.
CLI::App* AddWatch(CLI::App& app, WatchOptions& options);

}  // namespace baudgate::tools
