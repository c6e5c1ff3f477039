// SPDX-License-Identifier: Apache-2.0
#include "config/model/listener.h"

#include "gateway/base/text.h"

namespace baudgate::config {

std::string_view Name(Priority priority) {
  switch (priority) {
    case Priority::low:
      return "low";
    case Priority::normal:
      return "normal";
    case Priority::high:
      return "high";
  }
  return "normal";
}

std::string_view Name(Permit permit) {
  switch (permit) {
    case Permit::read:
      return "read";
    case Permit::data:
      return "data";
    case Permit::all:
      return "all";
  }
  return "all";
}

std::string Listener::Place() const { return is_serial() ? path : HostAndPort(host, port); }

}  // namespace baudgate::config
