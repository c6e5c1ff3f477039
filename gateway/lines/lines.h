// All lines of the gateway and the threads that they run on. Lines are numbered for good: one that
// a reload ends keeps its number, a new one gets the next. ThreadKindOf chooses a thread, LoopWatch
// finds loops that hang, LineDispatcher passes requests of outputs to their line, and
// ManualSettings is what a person has set.
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

// Decides whether a line runs on a thread of its own, because opening or closing the port may
// block, or on one of a few that many lines share; and how many those are. Used by Lines.
enum class ThreadKind : std::uint8_t { own_thread, shared_loop };

/// By the text of the configuration alone, because what a link leads to may change while the line
/// runs: "tcp://host:port" and "/dev/pts/7" never block; a driver of a serial port may, for half a
/// minute.
ThreadKind ThreadKindOf(std::string_view port);

/// Threads that lines share in turn: at least one, at most four. `cores`: of this machine, 0: not
/// known.
std::size_t SharedLoops(const std::vector<config::Line>& lines, std::size_t cores);

// Finds event loops that hang: each is asked once a second for a sign of life. If one of the
// gateway's own loops hangs, the gateway must be restarted; the loop of a single line concerns only
// that line. No thread, no clock and no loop of its own: gateway/daemon/daemon.cpp has them.

/// One thread at a time; signs come from any.
class LoopWatch {
 public:
  /// A loop hangs after this many looks in a row without a sign. Looks are counted, not seconds: a
  /// machine that slept has missed none.
  static constexpr int kStuckAfter = 5;

  /// Posts `sign` to the loop.
  using Ask = std::function<void(std::function<void()> sign)>;
  struct Change {
    std::string loop;
    std::optional<std::uint32_t> line;
    std::optional<WallTime> stuck_since;  ///< empty: it runs again
  };

  /// `line`: nothing but this line depends on the loop.
  void Add(std::string name, std::optional<std::uint32_t> line, Ask ask);
  /// The loop of a line that has ended.
  void Remove(std::uint32_t line);
  /// Returns which loops hang, or run again, since the last look. Asks all that have answered.
  std::vector<Change> Look(WallTime now);
  /// Whether all loops of the gateway itself had answered at the last look.
  bool complete() const { return complete_; }

 private:
  struct Loop {
    std::string name;
    std::optional<std::uint32_t> line;
    Ask ask;
    std::shared_ptr<std::atomic<bool>> answered;  // the loop may outlive this
    WallTime asked{};
    int missed = 0;
  };

  std::vector<Loop> loops_;
  bool complete_ = true;
};

class Lines {
 public:
  /// For the first attempt of new lines to open what they need.
  static constexpr Duration kWaitForPorts = 1s;
  /// For lines to end: a second for a write under way (line_port.cpp), and some room.
  static constexpr Duration kWaitForLines = 1300ms;

  /// `loops`: the number of threads for lines that never block, at least one. All
  /// references outlive it; lines have the numbers of the store.
  Lines(bus::PointStore& store, const config::Catalog& catalog, std::size_t loops);
  ~Lines();
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  /// What lines are joined with that are added from now on; it outlives them.
  void Link(LineParts::Links links) { links_ = std::move(links); }
  /// A thread of its own for a line whose driver may block; null: it needs none. The error: the
  /// system has no thread or no file descriptors left for it.
  static Result<std::shared_ptr<transports::LoopThread>> MakeLoop(const config::Line& line);
  /// The next of the store's lines, on this thread of its own or, without one, on a thread that it
  /// shares. It does not run before Start.
  void Add(std::shared_ptr<const config::Line> line,
           std::shared_ptr<transports::LoopThread> own = {});
  /// Those that do not run yet.
  void Start();
  /// A text for each port that these lines, which were just started, could not open: "line bay: no
  /// client can connect at 127.0.0.1:4001: address already in use". Waits for the first attempts,
  /// at most kWaitForPorts. Connections of lines over the network take longer and are not reported.
  std::vector<std::string> NotOpen(std::span<const std::uint32_t> lines) const;
  /// Ends these lines and closes their ports, within about a second. A line whose driver does not
  /// return from a call is abandoned.
  void Remove(std::span<const std::uint32_t> lines);
  /// Ends all, within about a second. Returns the names of those that hang.
  std::vector<std::string> Stop();
  /// Ends all, and waits for every driver.
  void End();
  /// After End: nothing runs any more.
  void StopLoops();

  std::size_t size() const { return entries_.size(); }
  /// Empty as well while a reload has put the line into the store and not yet here.
  LineSlot& at(std::uint32_t line) const {
    return line < entries_.size() ? entries_[line].slot : none_;
  }
  LineSlot& OfDevice(std::uint32_t device) const {
    return device < line_of_.size() ? at(line_of_[device]) : none_;
  }
  /// Never blocks, and runs as long as any line.
  asio::io_context& io() { return shared_.front()->io(); }
  std::size_t present() const;
  std::size_t open() const;
  std::optional<WallTime> stuck_since(std::uint32_t line) const;
  void OnHostClock(bool right);

  /// Another loop to be watched, which outlives this.
  void Watch(const std::string& name, asio::io_context& io);
  /// Reports loops that hang; called once a second. False: one that the whole gateway needs hangs.
  bool Look(WallTime now);

 private:
  struct LineEntry {
    explicit LineEntry(std::shared_ptr<const config::Line> its) : config(std::move(its)) {}
    std::shared_ptr<const config::Line> config;     // null: the line has ended
    std::shared_ptr<transports::LoopThread> own{};  // null: it shares one
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
  std::size_t turn_ = 0;  // of the shared loops
  SteadyVector<LineEntry> entries_;
  SteadyVector<std::uint32_t> line_of_;               // by device
  mutable LineSlot none_;                             // always empty
  std::vector<std::unique_ptr<LineRunner>> hanging_;  // their loops stay, too
  Mutex watch_mutex_;
  LoopWatch watch_ BAUDGATE_GUARDED_BY(watch_mutex_);
  Mutex clock_mutex_;
  std::optional<bool> clock_right_ BAUDGATE_GUARDED_BY(clock_mutex_);  // as told last
};

// Passes requests of outputs to their line: writes, loans of its port, whether a device is in use,
// its trace. The one CommandSink of all lines. From any thread.
class LineDispatcher final : public bus::CommandSink, public LineControl {
 public:
  /// All references outlive it.
  LineDispatcher(bus::PointStore& store, const config::Catalog& catalog, const Lines& lines)
      : store_(store), catalog_(catalog), lines_(lines) {}

  bool Submit(bus::WriteCommand command) override;
  void OnNotTaken(const bus::DeniedWrite& denied) override;

  void Release(std::uint32_t line, Duration time) override;
  void Offer(std::uint32_t line, config::PortServer server, Duration time) override;
  void TakeBack(std::uint32_t line) override;
  void SetInUse(std::uint32_t device, bool in_use) override;
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

// What a person has set at a running line by `release`, `disable` or `enable`: a reload that
// restarts the line carries it over. If a loan ended with the old line, there would be two masters
// on the bus. But a network client loses its connection with the old line, and polls go on.
//
//   bay-1 is lent until 12:00, its device a disabled; a reload changes the poll of a
//   bay-1 is restarted: lent until 12:00, a disabled
//
struct ManualSettings {
  WallTime released_until{};             ///< the epoch: the port is not lent by hand
  std::map<std::string, bool> in_use{};  ///< devices that differ from `enabled`
};

/// The manual settings of a running line, by its number.
ManualSettings ManualSettingsOf(const bus::PointStore& store, std::uint32_t line,
                                const config::Line& config);

/// Applies them to the line in its place, by its number, which is not started yet. If the new
/// configuration has changed `enabled` of a device, that holds.
void Restore(const ManualSettings& before, LineControl& lines, const config::Line& config,
             std::uint32_t line, std::uint32_t first_device, WallTime now);

}  // namespace baudgate::lines
