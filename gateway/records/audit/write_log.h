// The interface for records of writes: gateway/records/audit/audit_log.h saves them, tests only
// remember. From any thread; only WaitFor waits. WriteRecord is one record.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/writes/request_book.h"

namespace baudgate::audit {

// One write as the audit keeps it: its client, what it wanted, and the result. Values are in
// engineering units, as users see them, never bytes of a line. docs/audit.md has the fields for
// users.

/// Each kind has its own room in the file, so that a flood of one displaces no other.
enum class Kind : std::uint8_t {
  point,   ///< to a point: recorded before it is sent
  route,   ///< passed on as it was: recorded after its exchange
  denied,  ///< refused by the gateway
  loan,    ///< of a port over the network: its beginning, and its end
};
inline constexpr std::size_t kKinds = 4;

std::string_view Name(Kind kind);  ///< "point"

struct WriteRecord {
  std::int64_t seq = 0;  ///< from 1 on without a gap, over restarts; 0: it is not in the file yet
  Kind kind = Kind::point;
  WallTime time{};                      ///< when it was asked for; of repeats the first
  WallTime last{};                      ///< of repeats the last; else as `time`
  std::string client;                   ///< "192.0.2.5:40312", "user:root", "dds:GUID"
  std::string line;                     ///< or the server elsewhere: "10.0.0.9:502"
  std::string device;                   ///< its bare name; of a route "unit 20"
  std::string point;                    ///< of a route its function and address: "06 holding 100"
  Value before;                         ///< what the point showed before; empty: not known
  Value first;                          ///< of repeats the first value; else empty
  Value value;                          ///< the value to write; of repeats the last
  std::optional<WriteEnd> end;          ///< empty: it is under way
  std::string reason;                   ///< one sentence; empty when ok
  Duration took{};                      ///< from when it was asked for to its end
  std::uint64_t count = 1;              ///< of repeats, this one included
  std::optional<RequestId> request{};   ///< of repeats the first; empty if there was no number
  std::optional<std::int64_t> settled;  ///< its number among those that have ended; empty: not yet
};

/// Longer texts are cut.
inline constexpr std::size_t kLongestText = 240;
std::string Clipped(std::string text);

/// The name of its outcome, in the file and for programs: "ok", "unknown", …; "pending" while under
/// way.
std::string_view OutcomeOf(const WriteRecord& record);
std::optional<WriteEnd> EndNamed(std::string_view name);
std::optional<Kind> KindNamed(std::string_view name);

using Ticket = std::uint64_t;  ///< from 1 on, in the order of Begin

struct Ending {
  WriteEnd end = WriteEnd::unknown;
  std::string reason{};
  Duration took{};
};

/// A record as it must be in the file.
struct Draft {
  Ticket ticket = 0;
  std::uint64_t version = 0;
  bool ended = false;  ///< no change follows
  WriteRecord record;  ///< seq 0: it is not in the file yet
};

class WriteLog {
 public:
  enum class Written : std::uint8_t {
    yes,      ///< it is on the disk
    failing,  ///< the disk has said that it cannot
    late,     ///< the disk did not answer in time
  };
  virtual ~WriteLog() = default;
  /// A record of a write that is about to be done. Empty: there is no room for it.
  virtual std::optional<Ticket> Begin(WriteRecord record) = 0;
  virtual void End(Ticket ticket, const Ending& ending) = 0;
  /// Waits until the record of Begin, and all before it, are on the disk.
  virtual Written WaitFor(Ticket ticket, Instant until) = 0;
  /// A write that was done already, or denied; it was asked for at `asked`. Repeats share a record.
  virtual void Note(WriteRecord record, Instant asked) = 0;
  /// The last trouble of WaitFor, in words; empty: there is none.
  virtual std::string Trouble() const = 0;
};

}  // namespace baudgate::audit
