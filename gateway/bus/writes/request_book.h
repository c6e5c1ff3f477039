// `RequestBook` keeps which write requests have been seen, by client and number. A request that
// comes twice is answered twice, but carried out once:
//
//   plc-1 7 setting_group 1    fresh
//   plc-1 7 setting_group 1    under way; after its end the same answer again
//   plc-1 7 setting_group 2    denied: another request has this number
//   plc-1 3 setting_group 1    denied, if 32 later requests have pushed 3 out
//   a restart, plc-1 7 …       as before the restart, because the audit contains the request
//
// The size is limited; the time is an argument. docs/writes.md, "The same request again".
// `RequestId` is the identity of a request, `PastRequests` the requests of earlier runs in the
// audit.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate::bus {

// The identity of a write request: the name of the client and its number. A client that gets no
// answer repeats its request unchanged, and the gateway carries it out only once. The identity is a
// part of the command and is written to the audit, where the gateway reads it at its start.
struct RequestId {
  std::string client;     ///< a name that the client has chosen
  std::uint64_t seq = 0;  ///< number of the request, counted upwards by the client
  /// The content of the request: "feeder-1 setting_group 1 confirm". A request with the same number
  /// and another content is refused.
  std::string content;

  bool operator==(const RequestId&) const = default;
};

/// A request of an earlier run, as recorded in the audit.
struct PastRequest {
  RequestId id;
  WriteEnd end = WriteEnd::unknown;
  std::string reason;
  Duration took{};
  Duration age{};  ///< since the request was made
};

struct PastRequests {
  std::vector<PastRequest> all;  ///< the latest first
  bool complete = true;          ///< false: the file cannot be read at present
};

struct RequestAnswer {
  WriteEnd end = WriteEnd::ok;
  std::string reason;  ///< one sentence; empty when ok
  Duration took{};
};

class RequestBook {
 public:
  static constexpr std::size_t kClients = 128;
  static constexpr std::size_t kRemembered = 32;  ///< remembered requests of a client
  static constexpr std::size_t kUnderWay = 8;     ///< requests of a client that may be under way
  /// A client without a request for this time may be forgotten if another client needs its place.
  static constexpr Duration kKept = 10min;

  struct Verdict {
    enum class What : std::uint8_t {
      fresh,      ///< carry out the request, then call End
      under_way,  ///< the first request is under way; its answer will come
      answered,   ///< the request was answered before, with `answer`
      refused,    ///< the request is refused, with `answer`
    };
    What what = What::fresh;
    RequestAnswer answer{};
  };
  /// Returns the requests of earlier runs; empty: they are not known yet. See audit::AuditSource.
  using Past = std::function<std::optional<PastRequests>()>;
  /// `past` null: there are no requests of earlier runs.
  explicit RequestBook(Past past = {}) : past_(std::move(past)) {}

  /// Returns what to do with a request. It is refused as busy while the requests of earlier runs
  /// are not known.
  Verdict Begin(const RequestId& request, Instant now);
  /// Stores the answer to a fresh request.
  void End(const std::string& client, std::uint64_t seq, RequestAnswer answer);

  std::size_t clients() const { return clients_.size(); }

 private:
  struct Entry {
    std::string content;
    std::optional<RequestAnswer> answer;
  };
  struct Client {
    std::map<std::uint64_t, Entry> entries;  ///< by `seq`
    std::size_t under_way = 0;
    std::optional<std::uint64_t> forgotten{};  ///< the highest `seq` that was forgotten
    Instant last{};
  };

  bool ReadPast(Instant now);
  void Restore(const PastRequest& past, Instant now);
  Client* PlaceFor(const std::string& client, Instant now);
  static void ForgetOldest(Client& client);

  Past past_;  // null: clients_ contains the requests of earlier runs
  std::map<std::string, Client> clients_;
};

}  // namespace baudgate::bus
