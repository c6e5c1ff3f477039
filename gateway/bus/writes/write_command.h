// `WriteCommand` is a command on its way from an output to a line: a write to points, a read
// (`Reads`) or a telegram that a user has written (`Telegram`). Requests of transparent routes are
// in gateway/bus/writes/route_queue.h. WriteGate checks writes to points, the audit records
// commands that may write, and all commands wait in the queue of the line. The device confirms or
// refuses the command, or its deadline passes. Then End calls the observers and answers the client.
//
// The values of a write are raw: the output has decoded what its client sent, and WriteGate has
// checked the value and converted it to the raw value. Example: at a point with scale 0.1 the
// client writes 25, and the raw value is 250. After WriteGate no value is converted.
//
// `WriteState` is the progress of a command. EndUnheard returns the result of a write without an
// answer. `CommandSink` takes commands; `CommandRoom` limits how many wait for a line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/fair_places.h"
#include "gateway/base/guarded.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/writes/request_book.h"

namespace baudgate::bus {

// The progress of a write from the gate to its end, and the results that are possible from each
// state. The client gets one of these results, and the audit records it.
//
//   state          progress                                       possible ends
//   asked          accepted by the gate                           denied, busy, not_sent
//   queued         waits for its line, or for its next points     denied, refused, busy, not_sent
//   sent           a request that may have written was sent       ok, refused, busy, unknown
//   reading_back   confirmed by the device                        ok, differs; not_sent: the points
//                                                                 after the confirmed ones
enum class WriteState : std::uint8_t { asked, queued, sent, reading_back, ended };
inline constexpr std::size_t kWriteStates = 5;

/// True if a command can change from one state to another. Changes go forward, except to `queued`
/// for the next points of a command, or for a request that never left this machine; and from `sent`
/// to `sent`, when the request is sent again.
constexpr bool MayFollow(WriteState from, WriteState to) {
  switch (to) {
    case WriteState::asked:
      return false;
    case WriteState::queued:
      return from != WriteState::queued && from != WriteState::ended;
    case WriteState::sent:
      return from == WriteState::queued || from == WriteState::sent;
    case WriteState::reading_back:  // a command that only reads comes directly from `asked`
    case WriteState::ended:
      return from < to;
  }
  return false;
}

constexpr bool MayEnd(WriteState state, WriteEnd end) {
  switch (end) {
    case WriteEnd::ok:
      return state == WriteState::sent || state == WriteState::reading_back;
    case WriteEnd::differs:
      return state == WriteState::reading_back;
    case WriteEnd::refused:
      return state == WriteState::queued || state == WriteState::sent;
    case WriteEnd::busy:
      return state <= WriteState::sent;
    case WriteEnd::unknown:
      return state == WriteState::sent;
    case WriteEnd::not_sent:
      return state <= WriteState::queued || state == WriteState::reading_back;
    case WriteEnd::denied:
      return state <= WriteState::queued;
  }
  return false;
}

constexpr WriteEnd EndUnheard(bool sent) { return sent ? WriteEnd::unknown : WriteEnd::not_sent; }

inline constexpr const char* kClientLeft = "the client has disconnected";
inline constexpr const char* kTooLate =
    "the request was not sent, because its deadline passed while it waited for the line";

/// How long the command of a user waits for its device before it ends as not_sent.
inline constexpr Duration kWaitForDevice = std::chrono::seconds(5);

/// A value to write to a point. WriteGate makes it (Convert). The line sends `raw`; the audit and
/// the comparison after reading back use `shown`.
struct PointWrite {
  std::uint32_t point = 0;
  Value raw;  ///< the value that is sent, in the range of the type
  /// Value of the point directly before its request was sent; until then, when the write was
  /// requested. Empty: unknown.
  Value before{};
  Value shown{};  ///< value that the point shows when the device has accepted `raw`
};

/// The points are written in this order. The first failure ends the command.
using Writes = std::vector<PointWrite>;

/// The reason why a request is not sent, and the result of the write if the request belongs to one.
struct Withheld {
  WriteEnd end = WriteEnd::not_sent;
  std::string why;
  bool changed = false;  ///< see WriteResult::changed
};

/// Points that a client wants to be read now. WriteResult::read_back is true if all were read.
struct Reads {
  std::vector<std::uint32_t> points;
};

/// A telegram that a user has written (`baudgate ask`). The line sends it unchanged.
struct Telegram {
  Bytes bytes;            ///< the whole frame
  bool reads = false;     ///< the protocol guarantees that the telegram only reads
  std::string shown{};    ///< text for the record, with secrets masked
  Bytes reply{};          ///< the bytes that came back; valid when `done` is called
  std::string outcome{};  ///< outcome of the exchange, such as "ok" or "no_reply"
};

struct WriteCommand {
  std::uint32_t device = 0;  ///< index in the point store
  std::string client;  ///< name of the client, such as "192.0.2.5:40312", "user:root", "dds:GUID"
  std::optional<RequestId> request{};  ///< empty: the client gave no number
  std::variant<Writes, Reads, std::shared_ptr<Telegram>> kind;
  Instant deadline;  ///< the command is not sent later; if it still waits, it ends as not_sent
  /// Set by the line: number of the command among all writes to the line.
  std::uint64_t sequence = 0;
  WriteState state = WriteState::asked;
  /// Called directly before each request. Returns why the request must not be sent now; empty: the
  /// request can be sent. Null: there is no condition.
  std::function<std::optional<Withheld>(Instant now)> why_not;
  /// PointWrite::before of all points of the command as it was submitted, also of those that were
  /// removed from `kind` since. Set by the line; empty: no request was due yet.
  std::vector<Value> before{};
  /// Points to true when the client no longer waits. Then the command is not started; but if a
  /// request that may write was sent, the command continues to its end. Null: the client always
  /// waits.
  std::shared_ptr<const std::atomic<bool>> abandoned;
  using Ended = std::function<void(const WriteResult&)>;
  using Observer = std::function<void(const WriteCommand&, const WriteResult&)>;
  /// The audit and CommandRoom. End calls them before `done`, the last one first.
  std::vector<Observer> observers{};
  Ended done;

  const Writes& writes() const {
    static const Writes kNone;
    const auto* const writes = std::get_if<Writes>(&kind);
    return writes != nullptr ? *writes : kNone;
  }
  const std::vector<std::uint32_t>& reads() const {
    static const Reads kNone;
    const auto* const reads = std::get_if<Reads>(&kind);
    return reads != nullptr ? reads->points : kNone.points;
  }
  Telegram* telegram() const {
    const auto* const telegram = std::get_if<std::shared_ptr<Telegram>>(&kind);
    return telegram != nullptr ? telegram->get() : nullptr;
  }

  bool client_left() const { return abandoned && *abandoned; }

  /// Ends the command: calls the observers, then answers the client. Call exactly once, on any
  /// thread. Do not call it if Submit has returned false.
  void End(const WriteResult& result) {
    assert(MayEnd(state, result.end));
    MoveTo(WriteState::ended);
    for (std::size_t i = observers.size(); i-- > 0;) observers[i](*this, result);
    done(result);
  }
  void MoveTo(WriteState next) {
    assert(MayFollow(state, next));
    state = next;
  }
};

/// A write that the gateway has refused. It is recorded by the audit like any other write.
struct DeniedWrite {
  std::string client{};  ///< see WriteCommand::client
  std::optional<RequestId> request{};
  std::uint32_t device = 0;
  /// Index in the device's points; empty: the write was a telegram that a user has written.
  std::optional<std::uint32_t> point{};
  Value value{};                    ///< as users see it, not raw
  std::string reason{};             ///< one sentence
  WriteEnd end = WriteEnd::denied;  ///< denied or busy
  bool counts = true;  ///< false: another point of the same command was counted already
};

class CommandSink {
 public:
  virtual ~CommandSink() = default;
  /// Takes a command. Can be called from any thread. Returns false if the queue of the line is full
  /// or the line is stopping; `End` is not called then.
  virtual bool Submit(WriteCommand command) = 0;
  /// Records a write that the gateway has refused (denied or busy). Can be called from any thread;
  /// does not block.
  virtual void OnNotTaken(const DeniedWrite&) {}
};

// `CommandRoom` limits how many commands wait. A connection can have as many waiting commands as
// there are places free for others, and all connections of a host three times as many, so a host
// that writes without end does not block others. Commands of clients that have left are never sent
// and use no place, so a client that connects, writes and leaves again and again does not block
// others either.
//
//   32 places: the first connection has at most 16, a second one 8, and their host 24
//
// All functions can be called from any thread.
class CommandRoom {
 public:
  /// Points to true when the client of a command has left. Null: the client never leaves.
  using Abandoned = std::shared_ptr<const std::atomic<bool>>;
  using Ticket = std::uint64_t;

  /// Greatest number of commands of clients that have left and that the line has not discarded yet.
  static constexpr std::size_t kMostAbandoned = 1024;
  /// A host can have this many times as many commands as there are free places.
  static constexpr std::size_t kMostOfHost = 3;

  explicit CommandRoom(std::size_t limit) : limit_(limit) {}

  /// Takes a place for a command of the client. Empty: there is no place.
  std::optional<Ticket> Take(const std::string& client, Abandoned abandoned = nullptr) {
    const MutexLock lock(mutex_);
    const auto waits = [](const auto& held) { return !held.second.IsAbandoned(); };
    const auto taken = static_cast<std::size_t>(std::ranges::count_if(held_, waits));
    const std::uint64_t host = HostNumberOf(client);
    std::size_t own = 0;
    std::size_t of_host = 0;
    for (const auto& [ticket, held] : held_) {
      if (held.IsAbandoned() || held.host != host) continue;
      ++of_host;
      if (held.client == client) ++own;
    }
    if (own + taken >= limit_ || held_.size() - taken >= kMostAbandoned) return std::nullopt;
    if (of_host >= kMostOfHost * (limit_ - taken)) return std::nullopt;
    held_.emplace(++last_, Held{client, host, std::move(abandoned)});
    return last_;
  }
  void Give(Ticket ticket) {
    const MutexLock lock(mutex_);
    held_.erase(ticket);
  }

 private:
  struct Held {
    bool IsAbandoned() const { return abandoned && *abandoned; }

    std::string client;
    std::uint64_t host = 0;
    Abandoned abandoned;
  };

  const std::size_t limit_;
  Mutex mutex_;
  Ticket last_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<Ticket, Held> held_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::bus
