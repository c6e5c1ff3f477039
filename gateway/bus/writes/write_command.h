// `WriteCommand` is a write to points, a read (`Reads`) or a telegram by hand (`Telegram`) on its
// way from an output to a line. (Routed requests: gateway/bus/writes/route_queue.h.) Only writes to
// points pass the gate of all writers. Commands that may write pass the audit, and all pass the
// queue of the line. The device confirms or refuses the command, or its deadline passes; End then
// calls the observers and answers the client.
//
// The values of a write are raw. The output has made values of the words of its client; the gate
// has checked them and converted them to raw values. Example: at a point with scale 0.1 the
// registers "00 19" are the value 25, which is 250 for the device. After the gate no value is
// converted.
//
// `WriteState` is the progress of a command. EndUnheard returns the end of a write without an
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
#include "gateway/base/guarded.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/writes/request_book.h"

namespace baudgate::bus {

// The progress of a write from the gate to its end, and the ends that are possible from each state.
// The client gets, and the audit records, one of these ends.
//
//   state          progress                                       possible ends
//   asked          accepted by the gate                           denied, busy, not_sent
//   queued         waits for its line, or for its next points     denied, refused, busy, not_sent
//   sent           a request that may have written was sent       ok, refused, busy, unknown
//   reading_back   confirmed by the device                        ok, differs; not_sent: the points
//                                                                 after the confirmed ones
enum class WriteState : std::uint8_t { asked, queued, sent, reading_back, ended };
inline constexpr std::size_t kWriteStates = 5;

/// Returns whether a command may change from one state to another. States change forward only, with
/// two exceptions: the next points of a command, and a request that never left this machine. `sent`
/// to `sent` is a repetition.
constexpr bool MayFollow(WriteState from, WriteState to) {
  switch (to) {
    case WriteState::asked:
      return false;
    case WriteState::queued:
      return from != WriteState::queued && from != WriteState::ended;
    case WriteState::sent:
      return from == WriteState::queued || from == WriteState::sent;
    case WriteState::reading_back:  // directly from `asked`, if points are only read
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
    "the deadline of the request passed while it waited for the line";

/// How long the command of a user waits for its device.
inline constexpr Duration kWaitForDevice = std::chrono::seconds(5);

/// A value to write, made by the gate (Convert). The line sends `raw`; the audit and the comparison
/// with the read-back use `shown`.
struct PointWrite {
  std::uint32_t point = 0;  ///< index in the device's points
  Value raw;                ///< value that the conversation sends: in the range of the type
  Value before{};           ///< the value of the point when the write was requested; empty: unknown
  Value shown{};            ///< the value that the point shows when the device has taken over `raw`
};

/// Points are written in this order; the first failure ends the command.
using Writes = std::vector<PointWrite>;

/// Points to read now; WriteResult::read_back is true if all were read.
struct Reads {
  std::vector<std::uint32_t> points;  ///< indices in the device's points
};

/// One telegram by hand (`baudgate ask`), which the line sends as it is.
struct Telegram {
  Bytes bytes;            ///< the whole frame
  bool reads = false;     ///< the protocol proves that it is a read
  std::string shown{};    ///< for the record; secrets are masked
  Bytes reply{};          ///< bytes that have come back; valid when `done` is called
  std::string outcome{};  ///< outcome of the exchange: "ok", "no_reply"
};

struct WriteCommand {
  std::uint32_t device = 0;  ///< index in the point store
  std::string client;        ///< name of the client: "192.0.2.5:40312", "user:root", "dds:GUID"
  std::optional<RequestId> request{};  ///< empty if the client gave no number
  std::variant<Writes, Reads, std::shared_ptr<Telegram>> kind;
  Instant deadline;  ///< the command is not sent later; if it still waits then, it ends as not_sent
  /// Set by the line: place of the command among all writes to the line.
  std::uint64_t sequence = 0;
  WriteState state = WriteState::asked;
  /// Called directly before each request is sent. Returns why it must not be written now; empty: it
  /// may be. Null: there is no condition.
  std::function<std::optional<std::string>(Instant now)> why_not;
  /// True: the client no longer waits, so the command is not begun. Ignored once a request that may
  /// write was sent; the command then continues to its end.
  std::shared_ptr<const std::atomic<bool>> abandoned;
  using Ended = std::function<void(const WriteResult&)>;
  /// Parts that need the result: the audit, the room in the queue of the line.
  std::vector<Ended> observers{};
  Ended done;

  /// Returns the points to write; empty for another kind of command.
  const Writes& writes() const {
    static const Writes kNone;
    const auto* const writes = std::get_if<Writes>(&kind);
    return writes != nullptr ? *writes : kNone;
  }
  /// Returns the points to read; empty for another kind of command.
  const std::vector<std::uint32_t>& reads() const {
    static const Reads kNone;
    const auto* const reads = std::get_if<Reads>(&kind);
    return reads != nullptr ? reads->points : kNone.points;
  }
  /// Returns the telegram; null for another kind of command.
  Telegram* telegram() const {
    const auto* const telegram = std::get_if<std::shared_ptr<Telegram>>(&kind);
    return telegram != nullptr ? telegram->get() : nullptr;
  }

  bool client_left() const { return abandoned && *abandoned; }

  /// Ends the command: calls the observers, the latest first, then answers the client. Call exactly
  /// once, on any thread, unless Submit refused the command.
  void End(const WriteResult& result) {
    assert(MayEnd(state, result.end));
    MoveTo(WriteState::ended);
    for (std::size_t i = observers.size(); i-- > 0;) observers[i](result);
    done(result);
  }
  void MoveTo(WriteState next) {
    assert(MayFollow(state, next));
    state = next;
  }
};

/// A write that the gateway refused. It is recorded like any other write.
struct DeniedWrite {
  std::string client{};  ///< as in WriteCommand
  std::optional<RequestId> request{};
  std::uint32_t device = 0;  ///< index in the point store
  /// Index in the device's points; empty: a telegram, which is never counted.
  std::optional<std::uint32_t> point{};
  Value value{};                    ///< as users see it
  std::string reason{};             ///< one sentence
  WriteEnd end = WriteEnd::denied;  ///< denied or busy
  bool counts = true;               ///< false: another point of the same command was counted
};

class CommandSink {
 public:
  virtual ~CommandSink() = default;
  /// From any thread. Returns false if the queue of the line is full, or if the line is stopping;
  /// `End` is not called then.
  virtual bool Submit(WriteCommand command) = 0;
  /// The gateway has refused the write, as denied or busy. From any thread; returns at once.
  virtual void OnNotTaken(const DeniedWrite&) {}
};

// `CommandRoom` limits the commands that wait for a line. A client never has more commands there
// than there is room left for others, so a client that writes without end locks out no other. The
// same holds for a client that connects, writes and leaves again and again: commands of clients
// that have left are never sent, and take no room.
//
//   room for 32: one client has at most 16, a second client 8, a third 4 …
//
// From any thread.
class CommandRoom {
 public:
  /// True when the client of a command has left. Null: the client never leaves.
  using Abandoned = std::shared_ptr<const std::atomic<bool>>;
  using Ticket = std::uint64_t;

  /// The most abandoned commands that the line has not discarded yet.
  static constexpr std::size_t kMostAbandoned = 1024;

  explicit CommandRoom(std::size_t limit) : limit_(limit) {}

  /// Takes a place for a command of the client. Empty: there is no room.
  std::optional<Ticket> Take(const std::string& client, Abandoned abandoned = nullptr) {
    const MutexLock lock(mutex_);
    const auto waits = [](const auto& held) { return !held.second.IsAbandoned(); };
    const auto taken = static_cast<std::size_t>(std::ranges::count_if(held_, waits));
    const auto own = static_cast<std::size_t>(std::ranges::count_if(
        held_, [&](const auto& held) { return waits(held) && held.second.client == client; }));
    if (own + taken >= limit_ || held_.size() - taken >= kMostAbandoned) return std::nullopt;
    held_.emplace(++last_, Held{client, std::move(abandoned)});
    return last_;
  }
  /// Returns the place, because the command has been answered.
  void Give(Ticket ticket) {
    const MutexLock lock(mutex_);
    held_.erase(ticket);
  }

 private:
  struct Held {
    bool IsAbandoned() const { return abandoned && *abandoned; }

    std::string client;
    Abandoned abandoned;
  };

  const std::size_t limit_;
  Mutex mutex_;
  Ticket last_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<Ticket, Held> held_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::bus
