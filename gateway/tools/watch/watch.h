// `baudgate watch`: shows what gateways publish on DDS, as a live table, plain lines or JSON lines.
// Samples come from gateway/outputs/dds/fast/subscriber.h; the text goes to a stream. AddWatch adds
// the words of the command.
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
  std::string security;            ///< a folder as of config::SecurityIn; empty: without
  std::vector<std::string> peers;  ///< as of dds::ParticipantOptions
  std::vector<config::HostPort> discovery_servers{};  ///< the same
  bool multicast = true;                              ///< the same
  bool once = false;                ///< print the image when it is whole, then end
  bool events = false;              ///< events in place of points
  bool alarms = false;              ///< alarms in place of points
  bool json = false;                ///< one JSON object a line for each reading
  std::optional<Duration> seconds;  ///< end after this time; empty: at SIGINT or SIGTERM
  std::string gateway;              ///< only of this name; empty = all
  std::string device;
  std::string point;
  std::string point_order;  ///< a file, see point_image.h; empty: by name
  /// A live table for this terminal instead of plain lines; see TerminalView.
  std::optional<TableView> terminal;
  Duration first_sample_timeout = 10s;  ///< of `once`
};

/// Where to listen, and with which files.
dds::ParticipantOptions ParticipantOf(const WatchOptions& options);

/// Ends at SIGINT and SIGTERM as well. Returns the exit code: 0, or 4 when nothing was heard.
int RunWatch(const WatchOptions& options, std::ostream& out, std::ostream& err);

// The words of `baudgate watch`. Read by baudgate-dds; the gateway's binary passes them on.

/// Adds the subcommand; `options` outlive the parsing.
CLI::App* AddWatch(CLI::App& app, WatchOptions& options);

}  // namespace baudgate::tools
