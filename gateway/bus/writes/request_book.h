// Which requests have been seen, by client and number: one that comes twice is answered twice and
// carried out once.
//
//   plc-1 7 setting_group 1    fresh
//   plc-1 7 setting_group 1    under way, and as of its end: ok, again
//   plc-1 7 setting_group 2    denied: another one has that number
//   plc-1 3 setting_group 1    denied, once 32 later ones have pushed 3 out
//   a restart, plc-1 7 …       as before: the audit knows it
//
// Bounded; the caller passes the time. docs/writes.md, "The same request again".
//
// RequestId is the identity of a request, and PastRequests holds the earlier requests that the
// audit knows.
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

// The identity of a write request: the client's name and its own number. A client that gets no
// answer repeats its request unchanged, and the gateway carries it out only once. The identity is a
// part of the command and is written to the audit. A gateway reads it from there at its start.
// RequestBook compares identities.
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

struct RequestAnswer {
  WriteEnd end = WriteEnd::ok;
  std::string reason;  ///< one sentence; empty when ok
  Duration took{};
};

class RequestBook {
 public:
  static constexpr std::size_t kClients = 128;
  static constexpr std::size_t kRemembered = 32;  ///< requests of a client
  static constexpr std::size_t kUnderWay = 8;     ///< of these
  /// A client without a request for this time may be forgotten, if another needs its place.
  static constexpr Duration kKept = 10min;

  struct Verdict {
    enum class What : std::uint8_t {
      fresh,      ///< carry it out, then say End
      under_way,  ///< its answer will come
      answered,   ///< before, with `answer`
      refused,    ///< with `answer`
    };
    What what = What::fresh;
    RequestAnswer answer{};
  };
  /// The requests of earlier runs; empty: they are not known yet. See audit::AuditSource.
  using Past = std::function<std::optional<PastRequests>()>;
  /// Null: there are none.
  explicit RequestBook(Past past = {}) : past_(std::move(past)) {}

  /// Refused as busy while requests of earlier runs are not known.
  Verdict Begin(const RequestId& request, Instant now);
  /// Ends a request that was fresh.
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
    std::optional<std::uint64_t> forgotten{};  ///< the highest `seq` that was
    Instant last{};
  };

  bool ReadPast(Instant now);
  void Restore(const PastRequest& past, Instant now);
  Client* PlaceFor(const std::string& client, Instant now);
  static void ForgetOldest(Client& client);

  Past past_;  // null: clients_ has it
  std::map<std::string, Client> clients_;
};

}  // namespace baudgate::bus
