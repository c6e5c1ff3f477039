// `RunWatch` is `baudgate watch`: it shows what gateways publish on DDS, as a live table, plain
// lines or JSON lines. Samples come from gateway/outputs/dds/fast/subscriber.h.
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
  std::string security;            ///< folder for config::SecurityIn; empty: no security
  std::vector<std::string> peers;  ///< see dds::ParticipantOptions
  std::vector<config::HostPort> discovery_servers{};  ///< see dds::ParticipantOptions
  bool multicast = true;                              ///< see dds::ParticipantOptions
  bool once = false;                ///< wait until no new point comes, print all points, end
  bool events = false;              ///< show events instead of points
  bool alarms = false;              ///< show alarms instead of points
  bool json = false;                ///< print one JSON object for each reading
  std::optional<Duration> seconds;  ///< end after this time; empty: at SIGINT, SIGTERM or SIGHUP
  std::string gateway;              ///< only this gateway; empty = all
  std::string device;
  std::string point;
  std::string point_order;  ///< file for PointOrder; empty: sort points by name
  /// If set, a live table for this terminal instead of plain lines; see TerminalView.
  std::optional<TableView> terminal;
  Duration first_sample_timeout = 10s;  ///< timeout of `once` without any sample
};

/// Returns the DDS participant for these options: addresses, and security files.
dds::ParticipantOptions ParticipantOf(const WatchOptions& options);

/// Runs until the end that the options set, or SIGINT, SIGTERM or SIGHUP. Returns the exit code: 0;
/// 2 for `multicast` false without peers and discovery servers; 4 if no point was received or the
/// subscriber cannot be created.
int RunWatch(const WatchOptions& options, std::ostream& out, std::ostream& err);

// The command-line options of `baudgate watch`. baudgate-dds parses them; the gateway's binary
// passes them on.

/// Adds the subcommand. `options` must stay valid until the parsing has ended.
CLI::App* AddWatch(CLI::App& app, WatchOptions& options);

}  // namespace baudgate::tools
