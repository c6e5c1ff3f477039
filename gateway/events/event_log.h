// The events while the gateway runs: batches come from the lines, one thread of its own writes them
// to the file, and all that come while the disk is busy share the next commit: the first of an idle
// queue is written at once. While the disk fails they wait in memory, and it is tried again every
// second; their devices are not asked for more, and keep what they have.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/events/event_feed.h"
#include "gateway/events/event_file.h"
#include "gateway/events/event_source.h"
#include "gateway/events/own_codes.h"

namespace baudgate::events {

class EventLog final : public EventSource {
 public:
  static constexpr Duration kTick = 1s;

  struct Options {
    std::filesystem::path file;  ///< empty: there is no place for it
    std::string why_no_file{};
    std::string vfs{};                 ///< as in Database
    std::shared_ptr<FileTurn> turn{};  ///< as in EventsConnection
    SourceNames sources;
    std::function<Now()> clocks;
    std::shared_ptr<EventFeed> feed{};  ///< hears of what is on the disk; null: nobody does
    bool tells_own = false;             ///< the gateway's own events are kept, too
    /// Whether the configuration still has it; empty: it has all.
    std::function<bool(const Alarm&)> watches{};
    /// They are on the disk, so that their sources may be asked for more; on the writing thread.
    std::function<void(const std::vector<Source>& sources)> kept;
    /// One line when the disk begins to fail, and one when it is well again; from any thread.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
  };
  explicit EventLog(Options options);
  /// Writes what is left; as long as the disk takes.
  ~EventLog() override;

  /// From any thread; returns at once.
  void Add(Batch batch);
  /// An event of the gateway's own. The same; it is left out where there are too many like it.
  void Tell(EventRecord record);
  /// The gateway has started: told before all else, with how the one before has ended. So is then
  /// its end.
  void Started(const std::string& version);

  /// `opened` is called once, when the file has opened: on the writing thread, or from here.
  void WhenOpened(std::function<void()> opened);
  bool opened() const {
    const MutexLock lock(mutex_);
    return opened_;
  }
  /// A reload: all sources by their numbers; one that is gone has no names. What is known of a
  /// source goes with its names.
  void Renumber(SourceNames sources);

  /// What the last batch of the source that is kept has said; from any thread. When opened.
  std::string said(Source source) const;

  EventsState state() const override;
  std::vector<Alarm> Alarms() const override;
  void Acknowledge(const AckQuery& query, std::function<void(const Acknowledged&)> done) override;
  Result<Page> Read(const PageQuery& query) const override;

 private:
  struct Ack {
    std::size_t alarms = 0;
    std::function<void(const Acknowledged&)> done;
  };

  void Run();
  /// Until there is something to be written, or it is time to look.
  bool Sleep();
  void WriteDue();
  Status Open();
  void OnFirstOpened(const EventTable::Contents& contents) BAUDGATE_REQUIRES(mutex_);
  Status RestoreAlarms();
  void TakeNumbers() BAUDGATE_REQUIRES(mutex_);
  /// `acks`: of these batches.
  std::vector<Batch> TakeDue(std::vector<Ack>& acks);
  void Feed(const std::vector<Batch>& batches);
  void Show(Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);
  bool IsIdle() const BAUDGATE_REQUIRES(mutex_);
  EventRecord Own(OwnCode code, std::string text) const;

  const Options options_;
  SourceNames sources_;  // of the writing thread
  EventFile file_;       // likewise
  mutable Mutex mutex_;
  std::optional<SourceNames> renumbered_ BAUDGATE_GUARDED_BY(mutex_);  // to be sources_
  std::condition_variable due_;
  EventBook book_ BAUDGATE_GUARDED_BY(mutex_);
  bool opened_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::function<void()> tell_opened_ BAUDGATE_GUARDED_BY(mutex_);
  EventsState state_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<LastRun> last_run_ BAUDGATE_GUARDED_BY(mutex_);     // nothing: not opened yet
  std::optional<EventRecord> started_ BAUDGATE_GUARDED_BY(mutex_);  // to be told
  bool tells_end_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<Ack> acks_ BAUDGATE_GUARDED_BY(mutex_);  // of what waits
  bool restores_ = false;  // of the writing thread: the file may lack alarms
  bool stop_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace baudgate::events
