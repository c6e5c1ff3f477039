// A write to points on its way from an output back to a line, one object from the gate of all
// writers to its end; routed requests have gateway/bus/writes/routed.h. It passes the audit and the
// queue of its line; the device confirms or refuses it, or its deadline passes; End tells all that
// it has passed, and its client. Its values are raw: the output has made values of its client's
// words, and the gate has checked them and made raw values of those. Example: a point with scale
// 0.1; registers "00 19" are the value 25, which is 250 for the device. From here on nothing
// converts them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cassert>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/base/write_result.h"
#include "gateway/bus/writes/request_id.h"
#include "gateway/bus/writes/write_state.h"

namespace baudgate {

/// Why a command that waits is not sent any more.
inline constexpr const char* kClientLeft = "its client has left";
inline constexpr const char* kTooLate = "its deadline passed while it waited for the line";

/// How long a command of a user waits for its device.
inline constexpr Duration kWaitForDevice = std::chrono::seconds(5);

struct PointWrite {
  std::uint32_t point = 0;  ///< index in the device's points
  Value raw;                ///< as the conversation sends it: made by ToRaw, and so in range
  Value before{};  ///< what the point showed when the write was asked for; empty: not known
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

}  // namespace baudgate
