// WriteCommand is a write to points, a read (Reads) or a telegram by hand (Telegram) on its way
// from an output back to a line, one object to its end; routed requests have
// gateway/bus/writes/route_queue.h. Only writes pass the gate of all writers. What may write passes
// the audit, and all pass the queue of the line. The device confirms or refuses the command, or its
// deadline passes; End tells all that it has passed, and its client.
//
// The values of a write are raw: the output has made values of its client's words, and the gate has
// checked them and made raw values of those. Example: a point with scale 0.1; registers "00 19" are
// the value 25, which is 250 for the device. From here on nothing converts them.
//
// WriteState says how far a command has come, and EndUnheard how a write ends that nobody answered.
// CommandSink takes commands, and CommandRoom limits how many wait for a line.
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

// How far a write has come on its way from the gate to its end, and how it may end from there. Its
// client is told, and the audit records, one of these words.
//
//   state          so far                                         may end as
//   asked          let through by the gate                        denied, busy, not_sent
//   queued         waits for its line, or for its next points     denied, refused, busy, not_sent
//   sent           a request that may have written has gone out   ok, refused, busy, unknown
//   reading_back   confirmed by the device                        ok, differs; not_sent: the points
//                                                                 behind those
enum class WriteState : std::uint8_t { asked, queued, sent, reading_back, ended };
inline constexpr std::size_t kWriteStates = 5;

/// Forward only, except for the next points of a command, and for a request that never left this
/// machine; from `sent` to `sent` is a repetition.
constexpr bool MayFollow(WriteState from, WriteState to) {
  switch (to) {
    case WriteState::asked:
      return false;
    case WriteState::queued:
      return from != WriteState::queued && from != WriteState::ended;
    case WriteState::sent:
      return from == WriteState::queued || from == WriteState::sent;
    case WriteState::reading_back:  // at once where points are only read
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

/// The end of a write whose result is not known.
constexpr WriteEnd EndUnheard(bool sent) { return sent ? WriteEnd::unknown : WriteEnd::not_sent; }

/// Why a command that waits is not sent any more.
inline constexpr const char* kClientLeft = "the client has disconnected";
inline constexpr const char* kTooLate =
    "the deadline of the request passed while it waited for the line";

/// How long a command of a user waits for its device.
inline constexpr Duration kWaitForDevice = std::chrono::seconds(5);

/// Made by the gate (Convert), and not converted again: the line sends `raw`, the audit and the
/// comparison with what is read back take `shown`.
struct PointWrite {
  std::uint32_t point = 0;  ///< index in the device's points
  Value raw;                ///< as the conversation sends it: in the range of the type
  Value before{};  ///< what the point showed when the write was asked for; empty: not known
  Value shown{};   ///< what the point shows when the device has it
};

/// They are written in their order; the first that fails ends the command.
using Writes = std::vector<PointWrite>;

/// These points are read now; WriteResult::read_back says whether all were.
struct Reads {
  std::vector<std::uint32_t> points;  ///< indices in the device's points
};

/// One telegram by hand (`baudgate ask`), which the line sends as it is.
struct Telegram {
  Bytes bytes;            ///< the whole frame
  bool reads = false;     ///< the protocol proves that it is a read
  std::string shown{};    ///< for the record; secrets are masked
  Bytes reply{};          ///< what has come back, before `done` is called
  std::string outcome{};  ///< of the exchange: "ok", "no_reply"
};

struct WriteCommand {
  std::uint32_t device = 0;            ///< index in the point store
  std::string client;                  ///< its name: "192.0.2.5:40312", "user:root", "dds:GUID"
  std::optional<RequestId> request{};  ///< empty if the client gave no number
  std::variant<Writes, Reads, std::shared_ptr<Telegram>> kind;
  Instant deadline;            ///< nothing is sent later; what waits then ends as not_sent
  std::uint64_t sequence = 0;  ///< the line's own: its place among all writes to the line
  WriteState state = WriteState::asked;
  /// Called right before each request is sent: why it must not be written now; empty: it may be.
  /// Null: there is no such condition.
  std::function<std::optional<std::string>(Instant now)> why_not;
  /// True: its client waits for it no more, so it is not begun. Once something that may write was
  /// sent, this is not looked at, and it goes on to its end.
  std::shared_ptr<const std::atomic<bool>> abandoned;
  using Ended = std::function<void(const WriteResult&)>;
  /// Parts that must be told the result: the audit, the room in the line's queue.
  std::vector<Ended> observers{};
  /// Answers its client.
  Ended done;

  /// Empty, if it is of another kind.
  const Writes& writes() const {
    static const Writes kNone;
    const auto* const writes = std::get_if<Writes>(&kind);
    return writes != nullptr ? *writes : kNone;
  }
  /// Empty, if it is of another kind.
  const std::vector<std::uint32_t>& reads() const {
    static const Reads kNone;
    const auto* const reads = std::get_if<Reads>(&kind);
    return reads != nullptr ? reads->points : kNone.points;
  }
  /// Null, if it is of another kind.
  Telegram* telegram() const {
    const auto* const telegram = std::get_if<std::shared_ptr<Telegram>>(&kind);
    return telegram != nullptr ? telegram->get() : nullptr;
  }

  bool client_left() const { return abandoned && *abandoned; }

  /// It has ended: tells the observers, the latest first, then the client. Exactly once, on any
  /// thread, unless Submit refused the command.
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

/// A write that the gateway refused: recorded like any other write.
struct DeniedWrite {
  std::string client{};  ///< as in WriteCommand
  std::optional<RequestId> request{};
  std::uint32_t device = 0;  ///< index in the point store
  std::optional<std::uint32_t>
      point{};           ///< index in the device's points; empty: a telegram, which never counts
  Value value{};         ///< as users see it
  std::string reason{};  ///< one sentence
  WriteEnd end = WriteEnd::denied;  ///< or busy
  bool counts = true;  ///< false: another point of a command that was counted with its first
};

class CommandSink {
 public:
  virtual ~CommandSink() = default;
  /// From any thread. False: the line's queue is full, or it is stopping; `End` is not called.
  virtual bool Submit(WriteCommand command) = 0;
  /// The gateway has refused it, as denied or as busy. From any thread; returns at once.
  virtual void OnNotTaken(const DeniedWrite&) {}
};

// Room for the commands that wait for a line. No client has more of it than is left to others, so a
// client that writes without end locks nobody out. Nor does one that connects, writes and leaves
// again and again: commands of clients that have left are never sent, and take no room.
//
//   room for 32: one client has 16 at most, a second 8 beside it, a third 4 …
//
// From any thread.
class CommandRoom {
 public:
  /// True once the client of a command has left; null: it never does.
  using Abandoned = std::shared_ptr<const std::atomic<bool>>;
  using Ticket = std::uint64_t;

  /// Abandoned commands that the line has not discarded yet.
  static constexpr std::size_t kMostAbandoned = 1024;

  explicit CommandRoom(std::size_t limit) : limit_(limit) {}

  /// Empty: there is no room for another command of this client.
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
  /// The command has been answered.
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
