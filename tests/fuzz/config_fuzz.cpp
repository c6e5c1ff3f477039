// Fuzzes the loading of configurations. An accepted configuration loads a second time with the same
// result, and everything can be built from it. Input: the YAML text.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "config/loader.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "protocols/all_protocols.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

const config::Catalog& TheCatalog() {
  static const config::Catalog catalog = [] {
    config::Catalog all;
    for (const protocols::Protocol* protocol : protocols::AllProtocols())
      all.protocols.emplace(protocol->name, protocol);
    all.profile_dirs = {FUZZ_SOURCE_DIR "/tests/fuzz/profiles"};
    return all;
  }();
  return catalog;
}

void CheckProblems(const std::vector<config::Problem>& problems) {
  Require(problems.size() <= config::Problems::kMost, "problems are bounded");
  for (const config::Problem& problem : problems) {
    Require(!problem.message.empty(), "a problem says what is wrong");
    Require(problem.mark.line >= 0 && problem.mark.column >= 0, "a problem has a place");
    Require(ToString(problem).find('\n') == std::string::npos, "a problem is one line");
  }
}

void CheckDevice(const config::Device& device) {
  const protocols::Protocol* protocol = TheCatalog().FindProtocol(device.protocol);
  Require(protocol != nullptr, "a device has a protocol");
  Require(!device.name.empty() && protocol->canonical_address(device.address).ok(),
          "a device has a name and an address");
  Require(device.poll > Duration::zero() && device.slow > Duration::zero(), "periods are positive");
  for (const config::Point& point : device.points) {
    Require(protocol->check_point(point).ok(), "the protocol takes its points");
  }
  const auto bus = MakeBus(*protocol);
  const auto conversation = MakeConversation(*protocol, device, bus.get());
  for (std::size_t query = 0; query < conversation->Queries().size(); ++query) {
    protocols::Task task;
    task.query = query;
    Require(conversation->Ask(task, Instant(1h)).ok(), "what was accepted can be asked");
  }
}

void CheckSame(const config::Config& first, const config::Config& second) {
  Require(first.name == second.name && first.lines.size() == second.lines.size() &&
              first.modbus.listen.size() == second.modbus.listen.size(),
          "the same text gives the same configuration");
  for (std::size_t i = 0; i < first.lines.size(); ++i) {
    const config::Line& a = first.lines[i];
    const config::Line& b = second.lines[i];
    Require(a.name == b.name && a.port == b.port && a.serial.ToString() == b.serial.ToString() &&
                a.options.all() == b.options.all() && a.devices.size() == b.devices.size(),
            "the same text gives the same lines");
    for (std::size_t k = 0; k < a.devices.size(); ++k) {
      Require(a.devices[k].name == b.devices[k].name && a.devices[k].unit == b.devices[k].unit &&
                  a.devices[k].options.all() == b.devices[k].options.all() &&
                  a.devices[k].points.size() == b.devices[k].points.size(),
              "the same text gives the same devices");
    }
  }
}

void FuzzConfig(View bytes) {
  const std::string text(AsText(bytes));
  const auto loaded = config::LoadText(text, "fuzz.yaml", TheCatalog());
  CheckProblems(loaded.problems);
  if (!loaded.ok()) return;
  const auto again = config::LoadText(text, "fuzz.yaml", TheCatalog());
  Require(again.ok(), "what loads once loads twice");
  CheckSame(loaded.config, again.config);
  for (const config::Line& line : loaded.config.lines) {
    Require(!line.port.empty() && line.serial.baud > 0, "a line has a port and a speed");
    for (const config::Device& device : line.devices) CheckDevice(device);
  }
  for (const config::Route& route : loaded.config.modbus.routes) {
    Require(route.first <= route.last, "a route has units");
    if (route.line.empty()) continue;
    Require(route.line_index < loaded.config.lines.size() &&
                loaded.config.lines[route.line_index].name == route.line,
            "a route knows its line");
  }
  const modbus::RegisterMap map(loaded.config);
  Require(map.unit(0).kind == modbus::UnitMap::Kind::gateway, "unit 0 is the gateway");
}

const Registered kConfig("config", FuzzConfig);

}  // namespace
}  // namespace baudgate::fuzz
