// `WriteGate` checks every write to points: from Modbus clients, the command line, DDS and the
// correction of clocks. Routed writes do not pass it: for them only the `permit` of the listener
// holds (gateway/outputs/modbus/service/client_requests.cpp). The rules, in the order in which they
// are reported:
//
//   rule                                 denial        source
//   may the point be written?            read_only     rw in the profile and `write: allow`
//   may it have this value?              value         type, min, max, step
//   was it selected?                     not_selected  `select: yes`
//   does another point forbid it?        locked        allow_when; min and max that name a point
//                                                      whose value is unknown (beyond a known
//                                                      limit: value); checked again before sending
//   is there room in the line's queue?   busy
//
// A selection is taken before all other checks, so the first try uses it up, even if that is
// denied. A denial is reported to the sink; Deny does the same for denials of other parts. If the
// sink itself returns busy, it has recorded the write already (AuditedWrites). For one thread; each
// output has its own gate. docs/writes.md.
//
// Convert converts each value once: its raw value is checked, and the command carries it to the
// protocol, which only encodes it. WhyOutside, WhyInexact, WhyLocked, WhyBeyond and `Selections`
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

// Parsing of a value as people write it, for one point: "0.52", "on", "12". Used for writes of the
// command line.

/// bool: true, false, on, off, 1, 0. Whole numbers are exact. The error contains the valid texts.
Result<Value> ParseValue(const config::Point& point, std::string_view text);

// Rules for the value of a write: min, max, step and decimals of config::Writing, and whether the
// device can represent the value. Pure functions.

/// Returns the number with the unit of the point: "50 Hz".
std::string WithUnit(const config::Point& point, const Decimal& number);

/// Returns the decimal number that a client intended: 30.3 for the float32 30.299999237. Other
/// values are returned unchanged.
Value AsMeant(const config::Point& point, const Value& value);

/// Returns why the value is not allowed, in one sentence; empty: it is allowed. `value`: a result
/// of AsMeant.
std::optional<std::string> WhyOutside(const config::Point& point, const Value& value);

/// Returns the raw value for the device, and what the point shows when the device has taken it
/// over. A value to write is converted only here. The error: it is no value of the type.
Result<PointWrite> Convert(const config::Point& point, std::uint32_t index, const Value& value);

/// Returns why the device cannot represent exactly this value, in one sentence: scale and type have
/// no raw value for it, the raw value is a sentinel, or it has more digits than `decimals`. Empty:
/// the device can represent it. `write`: the result of Convert for `value`.
std::optional<std::string> WhyInexact(const config::Point& point, const Value& value,
                                      const PointWrite& write);

// Interlocks: whether the points that a write depends on have the required values (allow_when). A
// point that is bad, uncertain or was never read refuses the write.

/// Returns why `value` may not be written, in one sentence; empty: it may be.
std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& value, Instant now);

/// The reason why a limit that is another point of the device (`max: NAME`) forbids the value.
struct Beyond {
  bool known = true;  ///< false: the value of the limit is unknown
  std::string text;   ///< one sentence
};
std::optional<Beyond> WhyBeyond(const PointStore& store, std::uint32_t device,
                                const config::Point& point, const Value& value, Instant now);

/// True if the point has a limit that is another point, or an interlock. These are checked again
/// before each request.
bool IsGuarded(const config::Point& point);

// `Selections` keeps which points are selected, by which client and until when. A point that trips
// or resets something is written in two steps, so that a wrong register number moves nothing. The
// time is an argument. docs/writes.md, "Select before operate".
//
//   select 100 by client 7 at 0 s, for 10 s
//   take   100 by client 8 at 1 s             no: selected by another client
//   take   100 by client 7 at 3 s             yes, once
//   take   100 by client 7 at 4 s             no: used up
//
class Selections {
 public:
  /// The most selections at a time. A further selection drops the one that ends first.
  static constexpr std::size_t kLimit = 1024;

  struct Point {
    std::uint32_t device = 0;  ///< index in the point store
    std::uint32_t point = 0;   ///< index in the device's points
    auto operator<=>(const Point&) const = default;
  };
  enum class Verdict : std::uint8_t {
    selected,
    none,
    expired,  ///< the time of the selection is over
    foreign,  ///< selected by another client
  };

  void Select(std::uint64_t client, Point point, Instant until);
  /// Uses up the selection of the client.
  Verdict Take(std::uint64_t client, Point point, Instant now);
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

struct Writer {
  std::string name;          ///< WriteCommand::client
  std::uint64_t number = 0;  ///< number of its connection
  /// True: the client has left. Null: unknown.
  std::shared_ptr<const std::atomic<bool>> left{};
};

struct WriteAsk {
  struct Part {
    std::uint32_t point = 0;  ///< index in the device's points
    Value value{};            ///< as users see it
  };
  std::uint32_t device = 0;  ///< index in the point store
  std::vector<Part> parts;
  bool without_selection = false;      ///< the client has confirmed twice that it wants the write
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
  /// Store and sink must stay valid for the lifetime of this object.
  WriteGate(const PointStore& store, CommandSink& sink) : store_(store), sink_(sink) {}

  /// Checks the write and sends it on. Empty: it is under way, and `done` will be called. Else no
  /// part of it is sent.
  std::optional<WriteDenial> Submit(const Writer& writer, WriteAsk ask, Instant now);
  /// Returns the denial that the write would get now, apart from its selection. Sends and records
  /// nothing.
  std::optional<WriteDenial> WouldDeny(const WriteAsk& ask, Instant now) const;
  /// Selects a point with `select: yes`: the first of the two steps.
  std::optional<WriteDenial> Select(const Writer& writer, std::uint32_t device, std::uint32_t point,
                                    Instant now);
  /// Records a write that another part has denied, for this reason.
  void Deny(const Writer& writer, const WriteAsk& ask, const std::string& reason,
            WriteEnd end = WriteEnd::denied);
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
