// The fixture of route tests: unit 20 on the line "drive", and its slave's answers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tests/support/rtu_slave.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {

inline constexpr const char* kRoute = "{ units: 20, line: drive }";

class Routes : public RouteStation {
 protected:
  /// Answers as a slave whose register N contains 1000 + N. Confirms every write.
  static std::vector<Piece> Answer(View request) {
    if (request[1] == 6) return {{0ms, Bytes(request.begin(), request.end())}};
    return {{0ms, RegistersReply(request, 1000)}};
  }
  static std::vector<Piece> Nothing(View) { return {}; }
};

}  // namespace baudgate::system_test
