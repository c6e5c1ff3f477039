// The identity of a write request: the client's name and its own number. A client that gets no
// answer repeats its request unchanged, and the gateway carries it out only once. The identity is a
// part of the command and is written to the audit. A gateway reads it from there at its start.
// gateway/bus/writes/request_book.h compares.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/base/write_result.h"

namespace baudgate {

struct RequestId {
  std::string client;     ///< a name that the client has chosen
  std::uint64_t seq = 0;  ///< counts its requests upwards
  /// What the client asks for: "feeder-1 setting_group 1 confirm". A request with the same number
  /// and another content is refused.
  std::string content;

  bool operator==(const RequestId&) const = default;
};

/// A request of an earlier run, as the audit has it.
struct PastRequest {
  RequestId id;
  WriteEnd end = WriteEnd::unknown;
  std::string reason;
  Duration took{};
  Duration age{};  ///< since it was asked for
};

struct PastRequests {
  std::vector<PastRequest> all;  ///< the latest first
  bool complete = true;          ///< false: the file cannot be read at present
};

}  // namespace baudgate
