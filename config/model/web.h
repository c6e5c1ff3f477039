// The web page, its JSON and its metrics (gateway/outputs/web): where it listens, and which clients
// may come.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/model/fields.h"
#include "config/model/mark.h"
#include "config/model/network.h"

namespace baudgate::config {

struct Web {
  bool on = false;  ///< the key `web` is there
  HostPort listen{"127.0.0.1", 8502};
  std::vector<Network> allow;      ///< who may connect; empty = everybody
  std::vector<std::string> hosts;  ///< names of the gateway that browsers may use, in lower case
  std::string token_file;          ///< empty: nobody logs in
  bool acknowledge = false;        ///< alarms may be acknowledged
  Mark token_mark;                 ///< of token_file

  /// "127.0.0.1:8502", "[::1]:8502".
  std::string Place() const;
  bool on_loopback() const { return IsLoopback(ReachOf(listen.host)); }
};

template <typename Visit>
void VisitFields(const Web*, Visit visit) {
  visit(Field<&Web::on>{"web"});
  visit(Field<&Web::listen>());
  visit(Field<&Web::allow>());
  visit(Field<&Web::hosts>());
  visit(Field<&Web::token_file>{"token"});
  visit(Field<&Web::acknowledge>());
  visit(Derived<&Web::token_mark>());
}

}  // namespace baudgate::config
