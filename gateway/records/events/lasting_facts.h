// Which lasting facts about lines and devices have begun and are not over, by name: a reload that
// restarts a line gives it new numbers, but the end of a fact belongs to its beginning.
//
//   port_down of bay-1 … bay-1 is restarted … over      the end is news, though the new line has
//                                                       not told the beginning
//   ring_open of bay-1 … bay-1 is restarted             ends: the new line tells only its beginning
//   not_in_use of a … a is taken into use by a reload   ends
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/records/events/own_records.h"

namespace baudgate::events {

class LastingFacts {
 public:
  /// A device that the configuration does not use is out of use from the start.
  explicit LastingFacts(const config::Config& config);

  /// Takes note of it. False: it is not worth an event. `first`: its line has not told the
  /// beginning of what is over.
  bool IsNews(const Fact& fact, bool first);
  /// A reload; `begun`: lines that are new or restarted. Returns what has ended by it.
  std::vector<Fact> Renew(const config::Config& config, const std::set<std::string>& begun);

 private:
  using Place = std::pair<std::string, std::string>;  // line, device
  using Key = std::tuple<OwnCode, std::string, std::string>;

  std::vector<Place> NoteUse(const config::Config& config);

  std::set<Key> lasting_;
  std::map<Place, bool> enabled_;  // devices of the configuration
};

}  // namespace baudgate::events
