// `Forwarder` sends the stored values of the history to a receiver (an MQTT broker, a time-series
// database): in order for each point, and none is left out while the receiver is away. An output
// implements `Receiver` and owns a Forwarder:
//
//   Forwarder forwarder_({.name = "mqtt", .receiver = &client, .folder = state_folder, …});
//   forwarder_.SetHistory(history);   // in Output::SetHistory, at the start and after each reload
//   forwarder_.SetConnected(true);    // when the session is up
//
// The forwarder stores its place in outlet-NAME.db after the receiver has confirmed a portion. So a
// gateway that is killed sends its last values again, with the same `seq`. The forwarder reads the
// disk on a thread of its own, and holds one portion of values in memory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/base/worker.h"
#include "gateway/records/history/batch.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::outlet {

struct KeptValue {
  std::string point;  ///< LINE.DEVICE.POINT, also of a point that is no longer configured
  history::Entry entry{};
  /// Increases for each point, also over restarts and if the clock is set back; the same whenever
  /// the value is sent again; below 2^53. Usually entry.time.
  std::int64_t seq = 0;
};

struct Portion {
  std::vector<KeptValue> values;  ///< at least one; those of one point are sorted by `seq`
  /// True if an earlier attempt may have delivered these values: it got no answer, or the gateway
  /// was killed before it stored the answer.
  bool again = false;
};

struct Answer {
  enum class Kind : std::uint8_t {
    confirmed,  ///< the receiver has stored all values
    retry,      ///< the receiver is away or busy: the same portion is sent again later
    refused,    ///< the receiver does not accept at least one value, now or later
  };
  Kind kind = Kind::confirmed;
  /// One sentence for `status` and the log: why the values were not accepted. Example: "the broker
  /// at host:1883 does not answer".
  std::string why{};
  std::optional<Duration> wait{};  ///< retry: the wait that the receiver asked for
  /// refused: the indexes of the values that are not accepted; the other values are sent again.
  /// Empty: not known, so the portion is split in halves until the values are found.
  std::vector<std::size_t> refused{};
};

class Receiver {
 public:
  virtual ~Receiver() = default;
  /// Sends the values. Must return at once, and must call `done` once, on any thread, after a
  /// bounded time; also if the session ends. `done` may be called after the forwarder has ended.
  /// The next portion comes only after `done`.
  virtual void Send(Portion portion, std::function<void(Answer)> done) = 0;
};

/// Values that were deleted or damaged on the disk before the receiver had them.
struct Gap {
  history::Millis from = 0;
  history::Millis until = 0;
  std::string why{};
};

struct ForwarderState {
  bool has_history = false;     ///< false: the gateway stores no values, so none are forwarded
  Duration behind{};            ///< age of the oldest value that is not confirmed; 0: in step
  std::uint64_t sent = 0;       ///< values, repeated ones included; all counts since the start
  std::uint64_t confirmed = 0;  ///< values
  std::uint64_t put_aside = 0;  ///< values that the receiver has refused
  std::uint64_t gaps = 0;
  std::optional<Gap> last_gap{};
  /// Sentences; empty: no trouble. `trouble` is about the receiver or the disk, `refused` tells why
  /// the last value was put aside.
  std::string trouble{};
  std::optional<WallTime> trouble_since{};
  std::string refused{};
  std::optional<WallTime> refused_at{};
};

class Forwarder {
 public:
  struct Options {
    std::string name;  ///< "mqtt": names the files of the outlet and begins its messages
    Receiver* receiver = nullptr;    ///< must outlive the forwarder
    std::filesystem::path folder{};  ///< the state folder; empty: `why_no_folder`
    std::string why_no_folder{};
    std::size_t most = 1000;  ///< values in a portion
    bool connected = true;    ///< false: nothing is sent before SetConnected(true)
    std::function<Now()> clocks = &ReadClocks;
    /// Returns true for a point whose values the outlet forwards. Empty: all points of the history.
    std::function<bool(const std::string& point)> wanted{};
    /// Gets the state at least every 10 s, for alarms (AlarmsOf). Must return at once. Is not
    /// called after the forwarder has ended.
    std::function<void(const ForwarderState& state, Now now)> watch{};
    /// These receive one line for the log, on any thread.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
  };
  explicit Forwarder(Options options);
  /// Waits at most 2 s for the disk. A portion under way is not waited for.
  ~Forwarder();
  Forwarder(const Forwarder&) = delete;
  Forwarder& operator=(const Forwarder&) = delete;

  /// Thread-safe, as are all functions below. Null: there is no history.
  void SetHistory(std::shared_ptr<const history::HistorySource> history);
  /// False: no further portion is sent until SetConnected(true).
  void SetConnected(bool connected);
  ForwarderState state() const;

 private:
  std::shared_ptr<class Forwarding> forwarding_;
  Worker worker_;
};

}  // namespace baudgate::outlet
