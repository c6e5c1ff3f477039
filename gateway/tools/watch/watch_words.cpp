// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch_words.h"

#include "config/model/network.h"
#include "gateway/base/spelling.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate {
namespace {

/// What is wrong with it, or nothing.
std::string NotAMachine(const std::string& address) {
  if (config::IsMachineIpv4(address)) return {};
  return config::Quoted(address) +
         " is not the IPv4 address of a machine; write for example 10.0.0.7";
}

}  // namespace

CLI::App* AddWatch(CLI::App& app, WatchOptions& options) {
  auto* command = app.add_subcommand("watch", "Show what gateways publish on DDS");
  command->add_option("--domain", options.domain, "DDS domain")->check(CLI::Range(0, 232));
  command->add_option("--interface", options.interfaces, "Addresses to listen on")
      ->capture_default_str();
  command->add_option("--security", options.security,
                      "Folder with ca.pem, identity.pem, key.pem, governance.p7s, permissions.p7s");
  command->add_option("--peer", options.peers, "Machines that are asked beside the multicast group")
      ->check(CLI::Validator(NotAMachine, "IPV4"))
      ->expected(1, config::kMostPeers);
  command
      ->add_option_function<std::vector<std::string>>(
          "--discovery-server",
          [&options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const auto server = config::ParseDiscoveryServer(text);
              if (!server) throw CLI::ValidationError("--discovery-server", server.error());
              if (const std::string wrong = NotAMachine(server->host); !wrong.empty()) {
                throw CLI::ValidationError("--discovery-server", wrong);
              }
              options.discovery_servers.push_back(*server);
            }
          },
          "Discovery servers, HOST:PORT, that are asked beside the multicast group")
      ->expected(1, config::kMostDiscoveryServers);
  command->add_flag_callback(
      "--no-multicast", [&options] { options.multicast = false; },
      "Ask peers and discovery servers only");
  auto* once = command->add_flag("--once", options.once, "Print the values once, then end");
  command->add_flag("--json", options.json, "One JSON object a line for each reading");
  AddSeconds(*command, options.seconds);
  command->add_option("--gateway", options.gateway, "Only this gateway");
  command->add_option("--device", options.device, "Only this device");
  auto* point = command->add_option("--point", options.point, "Only this point");
  command->add_option("--point-order", options.point_order, "")->group("");  // of `baudgate watch`
  auto* events = command
                     ->add_flag("--events", options.events,
                                "What happens in devices: the newest events, then each as it comes")
                     ->excludes(once)
                     ->excludes(point);
  command
      ->add_flag("--alarms", options.alarms,
                 "Alarms: those that are not over or not acknowledged, then each change")
      ->excludes(once)
      ->excludes(events);
  return command;
}

}  // namespace baudgate
