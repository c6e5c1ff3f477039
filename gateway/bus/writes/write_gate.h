// `WriteGate` checks every write to points: from Modbus clients, the command line, DDS and the
// correction of clocks. Writes through transparent routes are not checked here, only by the
// `permit` of the listener (gateway/outputs/modbus/service/client_requests.cpp). The rules, in the
// order in which they are reported:
//
//   rule                                 denial        source
//   may the point be written?            read_only     rw in the profile and `write: allow`
//   may it have this value?              value         type, min, max, step
//   was it selected?                     not_selected  `select: yes`
//   does another point forbid it?        locked        allow_when; min and max that name a point
//                                                      whose value is unknown (beyond a known
//                                                      limit: value); checked again before sending
//   has it the value that the client     changed       `expect` of the client; checked again before
//   has seen?                                          sending
//   does the sink take the command?      busy          its queue is full (AuditedWrites); a full
//                                                      queue of the line ends it as busy later
//
// The first try uses up a selection, even if another rule denies the write. Submit reports a denial
// to the sink, which records it, except in two cases: a reload has removed the device; or the sink
// is busy and has recorded the write itself (AuditedWrites). An output that denies a write itself
// calls Deny. Each output has its own gate, which only one thread uses. See docs/writes.md.
//
// Convert converts each value once: the command contains the raw value, which the protocol only
// encodes. WhyOutside, WhyInexact, WhyLocked, WhyBeyond and `Selections` check one rule each.
// ParseValue reads a value from text.
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
#include "gateway/base/role.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate::bus {

/// Parses a value that a user has written on the command line, such as "0.52" or "12"; for a bool:
/// true, false, on, off, 1, 0. Whole numbers are exact. The error says what is valid.
Result<Value> ParseValue(const config::Point& point, std::string_view text);

/// Returns the number with the unit of the point, such as "50 Hz".
std::string WithUnit(const config::Point& point, const Decimal& number);

/// Returns the decimal number that a client meant by a float32, such as 30.3 for 30.299999237. For
/// other types returns `value`.
Value AsMeant(const config::Point& point, const Value& value);

/// Returns why the value is not allowed, in one sentence; empty: the value is allowed. `value`:
/// from AsMeant.
std::optional<std::string> WhyOutside(const config::Point& point, const Value& value);

/// Converts a value of users to the raw value for the device, and to the value that the point shows
/// when the device has accepted it. The error says why the value does not fit the type.
Result<PointWrite> Convert(const config::Point& point, std::uint32_t index, const Value& value);

/// Returns why the device cannot represent the value exactly, in one sentence; empty: the device
/// can. Reasons: scale and type have no raw value for it, the raw value is a sentinel, or it has
/// more digits than `decimals`. `write`: the result of Convert for `value`.
std::optional<std::string> WhyInexact(const config::Point& point, const Value& value,
                                      const PointWrite& write);

// Interlocks (allow_when): a write can require that other points have certain values. If one of
// these points is bad, uncertain or was never read, the write is refused.

/// Returns why an interlock forbids this value now, in one sentence; empty: no interlock does.
std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& value, Instant now);

/// Why a value is beyond a limit that is another point of the device (`max: NAME`).
struct Beyond {
  bool known = true;  ///< false: the value of the limit is not known
  std::string text;   ///< one sentence
};
std::optional<Beyond> WhyBeyond(const PointStore& store, std::uint32_t device,
                                const config::Point& point, const Value& value, Instant now);

/// True if the point has an interlock, or a limit that is another point. Interlock and limit are
/// checked again before each request.
bool IsGuarded(const config::Point& point);

/// Returns why the point may have another value than `expect` (WriteAsk::Part), in one sentence;
/// empty: the point has this value.
std::optional<std::string> WhyChanged(const PointStore& store, std::uint32_t device,
                                      std::uint32_t point, const std::string& expect);

// `Selections` contains which points are selected, by which client and until when. A point that
// trips or resets something is written in two steps: it is selected, then written. So a single
// write to a wrong register has no effect. The time is an argument. See docs/writes.md, "Select
// before operate". Example:
//
//   select 100 by client 7 at 0 s, for 10 s
//   take   100 by client 8 at 1 s             no: selected by another client
//   take   100 by client 7 at 3 s             yes, once
//   take   100 by client 7 at 4 s             no: used up
class Selections {
 public:
  /// Greatest number of selections. A further selection removes the selection that ends first.
  static constexpr std::size_t kLimit = 1024;

  struct Point {
    std::uint32_t device = 0;  ///< index in the point store
    std::uint32_t point = 0;
    auto operator<=>(const Point&) const = default;
  };
  enum class Verdict : std::uint8_t {
    selected,
    none,
    expired,
    foreign,  ///< selected by another client
  };

  void Select(std::uint64_t client, Point point, Instant until);
  /// Checks the selection of a point by this client, and removes it.
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
  std::string name;          ///< see WriteCommand::client
  std::uint64_t number = 0;  ///< number of the client's connection
  /// Points to true when the client has left. Null: this is not known.
  std::shared_ptr<const std::atomic<bool>> left{};
  std::uint64_t host = 0;  ///< number of the client's host (gateway/base/fair_places.h)
  /// Limits the requests that RequestHandler accepts from the client. Empty: all are accepted,
  /// because the gateway has no users, or the client is root or the gateway's own user.
  std::optional<Role> role{};
  /// The user and the address of a client of the page, for the security journal. `from` empty: the
  /// client is on this machine, and `name` is the user.
  std::string user{};
  std::string from{};
};

struct WriteAsk {
  struct Part {
    std::uint32_t point = 0;
    Value value{};  ///< as users see it, not raw
    /// The value that the client has seen, as text; "": the point had none. The write is denied if
    /// the point has another value. Empty: the client expects no value.
    std::optional<std::string> expect{};
  };
  std::uint32_t device = 0;  ///< index in the point store
  std::vector<Part> parts;
  bool without_selection = false;  ///< the client has confirmed twice, so no selection is needed
  std::optional<RequestId> request{};  ///< empty: the client gave no number
  Instant deadline{};
  std::shared_ptr<const std::atomic<bool>> abandoned{};  ///< see WriteCommand::abandoned
  std::function<void(const WriteResult&)> done{};
};

struct WriteDenial {
  enum class Why : std::uint8_t { read_only, value, not_selected, locked, changed, busy };
  Why why = Why::read_only;
  std::string text;  ///< one sentence
};

class WriteGate {
 public:
  /// `store` and `sink` must stay valid for the lifetime of this object.
  WriteGate(const PointStore& store, CommandSink& sink) : store_(store), sink_(sink) {}

  /// Checks the write and passes it to the sink. Empty: the write was accepted, and `done` will be
  /// called. Else no part of it is sent.
  std::optional<WriteDenial> Submit(const Writer& writer, WriteAsk ask, Instant now);
  /// Returns the denial that Submit would return now, without the rule about selections. Sends and
  /// records nothing.
  std::optional<WriteDenial> WouldDeny(const WriteAsk& ask, Instant now) const;
  /// Selects a point with `select: yes`, so that this client can write it for a limited time.
  std::optional<WriteDenial> Select(const Writer& writer, std::uint32_t device, std::uint32_t point,
                                    Instant now);
  /// Records a write that the output itself has denied, for `reason`.
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
