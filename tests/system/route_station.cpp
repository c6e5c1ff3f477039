// SPDX-License-Identifier: Apache-2.0
#include "tests/system/route_station.h"

#include <sstream>

namespace baudgate::system_test {
namespace {

/// Debian's own Python, because python3-pymodbus is installed only for it.
constexpr const char* kPython = "/usr/bin/python3";
constexpr const char* kTrouble =
    "pymodbus (python3-pymodbus, python3-serial, python3-serial-asyncio) did not do its part: ";

std::string Script(const std::string& name) {
  return std::string(SYSTEM_TEST_SOURCES) + "/" + name;
}

}  // namespace

std::string RouteStation::Yaml(const std::vector<std::string>& routes, const std::string& lines,
                               const std::vector<std::string>& more_listeners) const {
  std::ostringstream yaml;
  yaml << "gateway: { name: " << gateway() << ", socket: " << socket() << " }\n"
       << "modbus:\n  listen:\n    - { at: \"127.0.0.1:" << port() << "\" }\n";
  for (const std::string& listener : more_listeners) yaml << "    - " << listener << "\n";
  yaml << (routes.empty() ? "  routes: []\n" : "  routes:\n");
  for (const std::string& route : routes) yaml << "    - " << route << "\n";
  yaml << "dds: { enabled: false }\nlines:\n" << lines;
  return yaml.str();
}

std::string RouteStation::BareLine(const std::string& name, const std::string& keys,
                                   const std::string& protocol) const {
  return "  - { name: " + name + ", port: " + LinkOf(name) + ", protocol: " + protocol +
         (keys.empty() ? "" : ", " + keys) + " }\n";
}

std::unique_ptr<Child> RouteStation::StartPymodbusSlave(const std::string& framing,
                                                        const std::string& tty,
                                                        const std::string& units,
                                                        std::vector<std::string> ranges) const {
  std::vector<std::string> words = {kPython, Script("pymodbus_slave.py"), framing, tty, units};
  words.insert(words.end(), ranges.begin(), ranges.end());
  auto slave = std::make_unique<Child>(words, directory());
  const bool ready = Eventually(
      [&] { return !slave->Running() || slave->Output().find("ready") != std::string::npos; });
  EXPECT_TRUE(ready && slave->Running()) << kTrouble << slave->Errors();
  return slave;
}

Json RouteStation::Pymodbus(const std::string& framing, const std::string& where, int unit,
                            std::vector<std::string> commands) const {
  std::vector<std::string> words = {kPython, Script("pymodbus_master.py"), framing, where,
                                    std::to_string(unit)};
  words.insert(words.end(), commands.begin(), commands.end());
  const Finished master = RunToEnd(words, directory());
  EXPECT_EQ(master.code, 0) << kTrouble << master.errors;
  return Json::parse(master.output, nullptr, false);
}

Finished RouteStation::Mbpoll(std::vector<std::string> words) const {
  words.insert(words.begin(), {"mbpoll", "-1", "-q", "-0"});
  return RunToEnd(words, directory());
}

Finished RouteStation::MbpollTcp(const std::string& units, std::vector<std::string> words,
                                 std::vector<std::string> values) const {
  words.insert(words.begin(), {"-m", "tcp", "-p", std::to_string(port()), "-a", units});
  words.emplace_back("127.0.0.1");
  words.insert(words.end(), values.begin(), values.end());
  return Mbpoll(words);
}

std::unique_ptr<Child> RouteStation::StartGateway(const std::string& yaml,
                                                  const std::vector<std::string>& lines) const {
  auto daemon = StartDaemon(yaml);
  for (const std::string& line : lines) {
    EXPECT_TRUE(EventuallyLogged(*daemon, "line " + line + ": open")) << daemon->Errors();
  }
  return daemon;
}

Json RouteStation::Route(const std::string& units) const {
  const Json status = Status();
  for (const Json& route : status["modbus"]["routes"]) {
    if (route["units"] == units) return route;
  }
  return nullptr;
}

std::string MbpollLine(int address, int value) {
  return "[" + std::to_string(address) + "]: \t" + std::to_string(value);
}

}  // namespace baudgate::system_test
