// `Lines` holds all lines of the gateway and their threads. A line that a reload ends keeps its
// number, a new line gets the next number.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/line.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/lines/line_control.h"
#include "gateway/lines/line_runner.h"
#include "gateway/records/trace/line_recorder.h"
#include "transports/loop_thread.h"

namespace baudgate::lines {

// The thread of a line: its own, because opening or closing its port can block, or a loop that
// several lines share.
enum class ThreadKind : std::uint8_t { own_thread, shared_loop };

/// Decides by the text of `port` alone, because the target of a symbolic link can change while the
/// line runs. "tcp://host:port" and "/dev/pts/7" never block; the driver of a serial port can block
/// for half a minute.
ThreadKind ThreadKindOf(std::string_view port);

/// Returns how many loops are needed for lines that share loops: at least 1, at most 4, and at most
/// `cores`, the processor cores of this machine (0: unknown).
std::size_t SharedLoops(const std::vector<config::Line>& lines, std::size_t cores);

/// LoopWatch finds event loops that hang: once a second it posts a function to each loop, the sign.
/// A hanging loop on which the whole gateway depends requires a restart; a loop of one line affects
/// only this line. Lines::Look calls it. Not thread-safe, but a sign may be called on any thread.
class LoopWatch {
 public:
  /// A loop counts as hanging after this many calls of Look in a row without a sign. Calls are
  /// counted, not seconds, because no call is missed while the machine is suspended.
  static constexpr int kStuckAfter = 5;

  /// Posts `sign` to the loop; the loop is alive if it calls `sign`.
  using Ask = std::function<void(std::function<void()> sign)>;
  struct Change {
    std::string loop;
    std::optional<std::uint32_t> line;
    std::optional<WallTime> stuck_since;
  };

  /// `line`: only this line depends on the loop; empty: the whole gateway depends on it.
  void Add(std::string name, std::optional<std::uint32_t> line, Ask ask);
  void Remove(std::uint32_t line);
  /// Must be called once a second. Returns the loops that have begun to hang, or run again, since
  /// the last call. Posts a new sign to each loop that has answered.
  std::vector<Change> Look(WallTime now);
  /// True if all loops on which the whole gateway depends had answered at the last Look.
  bool complete() const { return complete_; }

 private:
  struct Loop {
    std::string name;
    std::optional<std::uint32_t> line;
    Ask ask;
    // Shared with the loop, which may live longer than this object.
    std::shared_ptr<std::atomic<bool>> answered;
    WallTime asked{};
    int missed = 0;
  };

  std::vector<Loop> loops_;
  bool complete_ = true;
};

class Lines {
 public:
  /// How long NotOpen waits for the first attempts of new lines to open their ports.
  static constexpr Duration kWaitForPorts = 1s;
  /// A line that has not stopped after this time is abandoned: 1 s for the current write
  /// (WriteGrace::kMost in gateway/lines/line_port.h), and 300 ms in reserve.
  static constexpr Duration kWaitForLines = 1300ms;

  /// `loops` is the number of threads for lines that never block, at least 1. The references must
  /// outlive this object. A line has the same number here as in `store`.
  Lines(bus::PointStore& store, const config::Catalog& catalog, std::size_t loops);
  ~Lines();
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  /// Sets the links of lines that are added from now on. Their targets must outlive the lines.
  void Link(LineParts::Links links) { links_ = std::move(links); }
  /// Starts a separate thread for a line whose driver may block; returns null for other lines.
  /// Fails if the system has no thread or no file descriptor left.
  static Result<std::shared_ptr<transports::LoopThread>> MakeLoop(const config::Line& line);
  /// Adds the next line of the store. It runs on `own`, or, if `own` is null, on a shared thread.
  /// It does not run before Start.
  void Add(std::shared_ptr<const config::Line> line,
           std::shared_ptr<transports::LoopThread> own = {});
  void Start();
  /// Waits until `lines`, which must have been started, have tried to open their ports, at most
  /// kWaitForPorts. Returns a text for each local port that is not open, and for each server of
  /// these lines that cannot listen: "line bay: no client can connect at 127.0.0.1:4001: address
  /// already in use". Connections over the network take longer and are not reported.
  std::vector<std::string> NotOpen(std::span<const std::uint32_t> lines) const;
  /// Ends these lines and closes their ports, within about a second. A line whose driver does not
  /// return from a call is abandoned.
  void Remove(std::span<const std::uint32_t> lines);
  /// Ends all lines within about a second. Returns the names of lines that hang.
  std::vector<std::string> Stop();
  /// Ends all lines, and waits for every driver without a limit.
  void End();
  /// Must be called after End.
  void StopLoops();

  std::size_t size() const { return entries_.size(); }
  /// Returns an empty slot for an unknown number, also while a reload has added the line to the
  /// store but not here.
  LineSlot& at(std::uint32_t line) const {
    return line < entries_.size() ? entries_[line].slot : none_;
  }
  LineSlot& OfDevice(std::uint32_t device) const {
    return device < line_of_.size() ? at(line_of_[device]) : none_;
  }
  /// Returns a loop that never blocks, and runs as long as any line.
  asio::io_context& io() { return shared_.front()->io(); }
  std::size_t present() const;
  std::size_t open() const;
  std::optional<WallTime> stuck_since(std::uint32_t line) const;
  void OnHostClock(bool right);

  /// Makes Look check `io`, on which the whole gateway depends. It must outlive this object.
  void Watch(const std::string& name, asio::io_context& io);
  /// Logs loops that hang, or run again; must be called once a second. Returns false if a loop on
  /// which the whole gateway depends has not answered since the last call.
  bool Look(WallTime now);

 private:
  struct LineEntry {
    explicit LineEntry(std::shared_ptr<const config::Line> its) : config(std::move(its)) {}
    std::shared_ptr<const config::Line> config;     // null: the line has ended
    std::shared_ptr<transports::LoopThread> own{};  // null: the line uses a shared thread
    LineSlot slot;
    bool started = false;
  };
  void OnLoop(const LoopWatch::Change& change);
  asio::io_context& LoopFor(LineEntry& entry);
  std::vector<LineRunner*> All() const;

  bus::PointStore& store_;
  const bus::Poller::FindProtocol find_;
  LineParts::Links links_;
  std::vector<std::unique_ptr<transports::LoopThread>> shared_;
  bool running_ = false;
  std::size_t turn_ = 0;  // counter that chooses the next shared loop
  SteadyVector<LineEntry> entries_;
  SteadyVector<std::uint32_t> line_of_;               // index: device; value: number of its line
  mutable LineSlot none_;                             // for unknown numbers; always empty
  std::vector<std::unique_ptr<LineRunner>> hanging_;  // abandoned lines, which keep their loops
  Mutex watch_mutex_;
  LoopWatch watch_ BAUDGATE_GUARDED_BY(watch_mutex_);
  Mutex clock_mutex_;
  // True if the clock of this machine is right, false if it is wrong; empty: not known yet.
  std::optional<bool> clock_right_ BAUDGATE_GUARDED_BY(clock_mutex_);
};

// LineDispatcher finds the line for each request of an output: a write, a loan of the port, use of
// a device, a trace. It is the CommandSink for the writes to all lines. Thread-safe.
class LineDispatcher final : public bus::CommandSink, public LineControl {
 public:
  /// The references must outlive this object.
  LineDispatcher(bus::PointStore& store, const config::Catalog& catalog, const Lines& lines)
      : store_(store), catalog_(catalog), lines_(lines) {}

  bool Submit(bus::WriteCommand command) override;
  void OnNotTaken(const bus::DeniedWrite& denied) override;

  void Release(std::uint32_t line, Duration time) override;
  void Offer(std::uint32_t line, config::PortServer server, Duration time) override;
  void TakeBack(std::uint32_t line) override;
  void SetInUse(std::uint32_t device, bool in_use, const std::string& by) override;
  const protocols::Protocol* FindProtocol(const std::string& name) const override;
  std::shared_ptr<records::TraceQueue> Trace(std::uint32_t line,
                                             std::function<void()> wake) override;
  std::vector<records::TraceRecord> Recorded(std::uint32_t line) override;

 private:
  void Count(std::uint32_t device, WriteEnd end);

  bus::PointStore& store_;
  const config::Catalog& catalog_;
  const Lines& lines_;
};

// ManualSettings are what a user has set on a running line by `baudgate release`, `disable` or
// `enable`. A reload that restarts the line sets them again: without them, the new line would open
// a port that is still lent, and two masters would be on the bus. A loan to a network client is not
// restored, because the client loses its connection with the old line.
//
//   bay-1 is lent until 12:00, its device a disabled; a reload changes the poll of a
//   bay-1 is restarted: lent until 12:00, a disabled
struct ManualSettings {
  WallTime released_until{};             ///< the epoch: the port is not lent by hand
  std::map<std::string, bool> in_use{};  ///< devices whose use differs from `enabled`; true: in use
};

ManualSettings ManualSettingsOf(const bus::PointStore& store, std::uint32_t line,
                                const config::Line& config);

/// Applies `before` to the line that replaces the old line and is not started yet. If the new
/// configuration has changed `enabled` of a device, the configuration wins.
void Restore(const ManualSettings& before, LineControl& lines, const config::Line& config,
             std::uint32_t line, std::uint32_t first_device, WallTime now);

}  // namespace baudgate::lines
