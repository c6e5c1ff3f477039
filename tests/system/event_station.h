// The fixture of event tests: a simulated relay that has events, and the gateway that stores them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/system/station.h"

namespace baudgate::system_test {

class EventStation : public Station {
 protected:
  /// `top` is put before all other keys. "events: {}\n" makes the gateway record its own events,
  /// too.
  std::string Yaml(const std::string& keys = ", events: on", const std::string& top = "",
                   bool dds = false) const {
    return top + WithSocket(Head(dds), "state: " + LinkOf("state") + ", ") +
           Line("bay", "spabus", "address: 1, unit: 1, profile: spaj140c, poll: 100ms" + keys);
  }
  std::unique_ptr<Child> StartRelay(const std::string& events) const {
    return StartTwin("bay", "spaj140c", "1", {"--think", "1ms", "--events", events});
  }
  Finished Ask(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), "events");
    return Station::Ask(more);
  }
  std::vector<Json> Records(std::vector<std::string> more = {}) const {
    more.emplace_back("--json");
    return JsonLines(Ask(more).output);
  }
};

}  // namespace baudgate::system_test
