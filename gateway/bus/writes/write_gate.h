// Every write to points passes here: from Modbus clients, the command line, DDS and the correction
// of clocks. Routed writes do not: only the listener's `permit` holds for them
// (gateway/outputs/modbus/service/client_requests.cpp). The rules, in this order, before anything
// is sent:
//
//   may the point be written?            read_only     rw in the profile and `write: allow`
//   may it have this value?              value         type, min, max, step
//   was it selected?                     not_selected  where `select: yes` stands
//   does another point forbid it?        locked        allow_when; min and max that name a point
//                                                      whose value is not known (beyond a known
//                                                      one: value); asked again before sending
//   is there room in the line's queue?   busy
//
// That is the order of what is reported. A selection is taken before anything else, so it is used
// up by the first try, whatever becomes of it. A denial is handed to the sink, as is what another
// part denies or finds no room for (Deny). If the sink itself says busy, it has recorded that
// already (AuditedWrites). For one thread; each output has its own gate. docs/writes.md.
//
// Each value is converted once, by Convert: its raw value is checked, and the command carries it to
// the protocol, which only encodes it. WhyOutside, WhyInexact, WhyLocked, WhyBeyond and Selections
// check one rule each. ParseValue reads a value from text.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate::bus {

// A value as people write it, for one point: "0.52", "on", "12". Used by the command line's writes.

/// bool: true, false, on, off, 1, 0. Whole numbers exactly. The error says which texts are valid.
Result<Value> ParseValue(const config::Point& point, std::string_view text);

// Whether a value may be written to a point: min, max, step and decimals of config::Writing, and
// whether the device can represent it. Pure.

/// "50 Hz".
std::string WithUnit(const config::Point& point, const Decimal& number);

/// The decimal number that a client meant: 30.3 for the float32 30.299999237. Others as they are.
Value AsMeant(const config::Point& point, const Value& value);

/// Why not, in one sentence; empty: it may be. `value` as AsMeant gives it.
std::optional<std::string> WhyOutside(const config::Point& point, const Value& value);

/// The raw value for the device, and what the point shows when the device has it. The only place
/// where a value that is written is converted. The error: no value of the type.
Result<PointWrite> Convert(const config::Point& point, std::uint32_t index, const Value& value);

/// Why the device cannot represent exactly this value, in one sentence: scale and type have no raw
/// value for it, the raw value is a sentinel, or it has more digits than `decimals`; empty: it can.
/// `write`: what Convert makes of `value`.
std::optional<std::string> WhyInexact(const config::Point& point, const Value& value,
                                      const PointWrite& write);

// Whether the points that a write depends on have the required values (allow_when). A point that is
// bad, uncertain or was never read refuses the write.

/// Why `value` may not be written, in one sentence; empty: it may be.
std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& value, Instant now);

/// Why a limit that is another point of the device (`max: NAME`) forbids the value.
struct Beyond {
  bool known = true;  ///< false: the limit is not
  std::string text;   ///< one sentence
};
std::optional<Beyond> WhyBeyond(const PointStore& store, std::uint32_t device,
                                const config::Point& point, const Value& value, Instant now);

/// The point has such a limit, or an interlock: it is looked at again before each request.
bool IsGuarded(const config::Point& point);

// Which points are selected, by which client and until when. A point that trips or resets something
// is written in two steps, so that one wrong register number moves nothing.
//
//   select 100 by client 7 at 0 s, for 10 s
//   take   100 by client 8 at 1 s             no: another client's
//   take   100 by client 7 at 3 s             yes, once
//   take   100 by client 7 at 4 s             no: it is used up
//
// Knows no clock. docs/writes.md, "Select before operate".
class Selections {
 public:
  /// Most selections at a time; one more drops the one that ends first.
  static constexpr std::size_t kLimit = 1024;

  struct Point {
    std::uint32_t device = 0;  ///< index in the point store
    std::uint32_t point = 0;   ///< index in the device's points
    auto operator<=>(const Point&) const = default;
  };
  enum class Verdict : std::uint8_t {
    selected,
    none,     ///< not selected
    expired,  ///< its time is over
    foreign,  ///< selected by another client
  };

  void Select(std::uint64_t client, Point point, Instant until);
  /// Uses up the client's own selection.
  Verdict Take(std::uint64_t client, Point point, Instant now);
  /// The client has left.
  void Forget(std::uint64_t client);

  std::size_t size() const { return until_.size(); }

 private:
  struct Key {
    Point point;
    std::uint64_t client = 0;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, Instant> until_;
};

/// A client: its name for the record, its number for selections.
struct Writer {
  std::string name;          ///< WriteCommand::client
  std::uint64_t number = 0;  ///< its connection
  /// True: it has left. Null: that is not known.
  std::shared_ptr<const std::atomic<bool>> left{};
};

struct WriteAsk {
  struct Part {
    std::uint32_t point = 0;  ///< index in the device's points
    Value value{};            ///< as users see it
  };
  std::uint32_t device = 0;  ///< index in the point store
  std::vector<Part> parts;
  bool without_selection = false;      ///< the client has said twice that it means it
  std::optional<RequestId> request{};  ///< see WriteCommand
  Instant deadline{};
  std::shared_ptr<const std::atomic<bool>> abandoned{};  ///< see WriteCommand
  std::function<void(const WriteResult&)> done{};
};

struct WriteDenial {
  enum class Why : std::uint8_t { read_only, value, not_selected, locked, busy };
  Why why = Why::read_only;
  std::string text;  ///< one sentence
};

class WriteGate {
 public:
  /// Store and sink outlive it.
  WriteGate(const PointStore& store, CommandSink& sink) : store_(store), sink_(sink) {}

  /// Empty: it is under way, and `done` will be called. Else nothing of it is sent.
  std::optional<WriteDenial> Submit(const Writer& writer, WriteAsk ask, Instant now);
  /// The denial that it would get now, even without a selection. Nothing is sent or recorded.
  std::optional<WriteDenial> WouldDeny(const WriteAsk& ask, Instant now) const;
  /// The first of the two steps of a point with `select: yes`.
  std::optional<WriteDenial> Select(const Writer& writer, std::uint32_t device, std::uint32_t point,
                                    Instant now);
  /// Another part has denied it, for this reason: it is only recorded.
  void Deny(const Writer& writer, const WriteAsk& ask, const std::string& reason,
            WriteEnd end = WriteEnd::denied);
  /// The client has left.
  void Forget(const Writer& writer) { selections_.Forget(writer.number); }

 private:
  std::optional<WriteDenial> CheckAndConvert(const Writer& writer, const config::Device& device,
                                             const WriteAsk& ask, Instant now, Writes& writes);
  static std::optional<WriteDenial> ConvertValues(const config::Device& device, const WriteAsk& ask,
                                                  Writes& writes);
  static void RestoreDecimals(const config::Device& device, WriteAsk& ask);
  std::optional<std::string> WhyNotSelected(const Writer& writer, const config::Device& device,
                                            const WriteAsk& ask, Instant now);

  const PointStore& store_;
  CommandSink& sink_;
  Selections selections_;
};

}  // namespace baudgate::bus
