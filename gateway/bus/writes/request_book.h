// `RequestBook` remembers write requests by client and number, because a client that gets no answer
// sends its request again. A request that comes twice is answered twice, but carried out once:
//
//   plc-1 7 setting_group 1    fresh: carried out
//   plc-1 7 setting_group 1    under way; when it has ended, the same answer again
//   plc-1 7 setting_group 2    denied: another request has this number
//   plc-1 3 setting_group 1    denied, if request 3 was forgotten after 32 later requests
//   a restart, plc-1 7 …       as before the restart, because the audit contains the request
//
// The memory is limited; the time is an argument. See docs/writes.md, "The same request again".
// `RequestId` identifies a request; `PastRequests` are those of earlier runs, from the audit.
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

// `RequestId` identifies a write request by the name of its client and a number. The audit records
// it, and the gateway reads the audit at its start.
struct RequestId {
  std::string client;     ///< a name that the client has chosen
  std::uint64_t seq = 0;  ///< number of the request, counted upwards by the client
  /// The content of the request, such as "feeder-1 setting_group 1 confirm". A request with a known
  /// number but another content is refused.
  std::string content;

  bool operator==(const RequestId&) const = default;
};

/// A request of an earlier run of the program, as recorded in the audit.
struct PastRequest {
  RequestId id;
  WriteEnd end = WriteEnd::unknown;
  std::string reason;
  Duration took{};
  Duration age{};
};

struct PastRequests {
  std::vector<PastRequest> all;  ///< the latest is the first
  bool complete = true;  ///< false: a part of the audit cannot be read yet, so it is read again
};

struct RequestAnswer {
  WriteEnd end = WriteEnd::ok;
  std::string reason;  ///< see WriteResult::reason
  Duration took{};
};

class RequestBook {
 public:
  static constexpr std::size_t kClients = 128;
  static constexpr std::size_t kRemembered = 32;
  /// Greatest number of requests of a client that are carried out at the same time.
  static constexpr std::size_t kUnderWay = 8;
  /// A client that has sent nothing for this time can be forgotten if another client needs its
  /// entry.
  static constexpr Duration kKept = 10min;

  struct Verdict {
    enum class What : std::uint8_t {
      fresh,      ///< the request is to be carried out; call End afterwards
      under_way,  ///< the same request is being carried out; the answer comes when it has ended
      answered,   ///< the same request was answered before, with `answer`
      refused,    ///< the request is refused, with `answer`
    };
    What what = What::fresh;
    RequestAnswer answer{};
  };
  /// Returns the requests of earlier runs; empty: they have not been read yet. See
  /// audit::AuditSource in gateway/records/audit/audit_source.h.
  using Past = std::function<std::optional<PastRequests>()>;
  /// `past` is null if there are no requests of earlier runs.
  explicit RequestBook(Past past = {}) : past_(std::move(past)) {}

  /// Returns what to do with a request. While the requests of earlier runs are not read, a request
  /// is refused as busy.
  Verdict Begin(const RequestId& request, Instant now);
  void End(const std::string& client, std::uint64_t seq, RequestAnswer answer);

  std::size_t clients() const { return clients_.size(); }

 private:
  struct Entry {
    std::string content;
    std::optional<RequestAnswer> answer;
  };
  struct Client {
    std::map<std::uint64_t, Entry> entries;
    std::size_t under_way = 0;
    std::optional<std::uint64_t> forgotten{};  ///< the highest `seq` that was forgotten
    Instant last{};
  };

  bool ReadPast(Instant now);
  void Restore(const PastRequest& past, Instant now);
  Client* PlaceFor(const std::string& client, Instant now);
  static void ForgetOldest(Client& client);

  Past past_;  // null: there are no requests of earlier runs that have not been read
  std::map<std::string, Client> clients_;
};

}  // namespace baudgate::bus
