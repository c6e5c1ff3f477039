// `RunWatch` is `baudgate watch`: it shows what gateways publish on DDS, as a live table, as text
// lines or as JSON lines. Samples come from gateway/outputs/dds/fast/subscriber.h.
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
  /// Folder with the security files, see config::SecurityIn; empty: no security.
  std::string security;
  std::vector<std::string> peers;                     ///< see dds::ParticipantOptions
  std::vector<config::HostPort> discovery_servers{};  ///< see dds::ParticipantOptions
  bool multicast = true;                              ///< see dds::ParticipantOptions
  bool once = false;                ///< true: wait until no new point comes, print all points, end
  bool events = false;              ///< true: show events instead of points
  bool alarms = false;              ///< true: show alarms instead of points
  bool json = false;                ///< true: print one JSON object for each reading
  std::optional<Duration> seconds;  ///< end after this time; empty: at SIGINT, SIGTERM or SIGHUP
  std::string gateway;              ///< show only this gateway; empty: all gateways
  std::string device;
  std::string point;
  std::string point_order;  ///< file for PointOrder; empty: points are sorted by name
  /// Set: shows a live table on this terminal instead of text lines; see TerminalView.
  std::optional<TableView> terminal;
  Duration first_sample_timeout = 10s;  ///< how long `once` waits for the first sample
};

dds::ParticipantOptions ParticipantOf(const WatchOptions& options);

/// Runs until SIGINT, SIGTERM or SIGHUP, or until the end that `once` or `seconds` sets. Returns
/// the exit code: 0; 2 for `multicast` false without peers and discovery servers; 4 if no point was
/// received, or the subscriber cannot be created.
int RunWatch(const WatchOptions& options, std::ostream& out, std::ostream& err);

// The command-line options of `baudgate watch`. The gateway's program passes them on to
// baudgate-dds, which parses them.

/// `options` must stay valid until parsing has ended.
CLI::App* AddWatch(CLI::App& app, WatchOptions& options);

}  // namespace baudgate::tools
