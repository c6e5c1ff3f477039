// A relay's twin that has events, and the gateway that keeps them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/system/station.h"

namespace baudgate::system_test {

class EventStation : public Station {
 protected:
  /// Events of the relay only; with "events: {}\n" at the top also those of the gateway.
  std::string Yaml(const std::string& keys = ", events: on", const std::string& top = "",
                   bool dds = false) const {
    std::string head = Head(dds);
    head.replace(0, head.find('\n'),
                 "gateway: { name: " + gateway() + ", socket: " + socket() +
                     ", state: " + (directory() / "state").string() + " }");
    return top + head +
           Line("bay", "spabus", "address: 1, unit: 1, profile: spaj140c, poll: 100ms" + keys);
  }
  std::string socket() const { return (directory() / "gate.sock").string(); }
  std::unique_ptr<Child> StartRelay(const std::string& events) const {
    auto twin = Start({"simulate", "--profile", "spaj140c", "--address", "1", "--pty",
                       LinkOf("bay"), "--think", "1ms", "--events", events});
    EXPECT_TRUE(Eventually([&] { return !twin->Output().empty(); })) << twin->Errors();
    return twin;
  }
  Finished Ask(std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"events", "--socket", socket()};
    words.insert(words.end(), more.begin(), more.end());
    return Command(words);
  }
  std::vector<nlohmann::json> Records(std::vector<std::string> more = {}) const {
    more.emplace_back("--json");
    const Finished events = Ask(more);
    std::vector<nlohmann::json> records;
    std::istringstream lines(events.output);
    for (std::string line; std::getline(lines, line);)
      records.push_back(nlohmann::json::parse(line));
    return records;
  }
  nlohmann::json Status() const {
    return nlohmann::json::parse(Command({"status", "--json", "--socket", socket()}).output);
  }
};

}  // namespace baudgate::system_test
