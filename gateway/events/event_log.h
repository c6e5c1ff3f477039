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
#include "gateway/events/event_file.h"
#include "gateway/events/event_source.h"

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

  /// `opened` is called once, when the file has opened: on the writing thread, or from here.
  void WhenOpened(std::function<void()> opened);
  /// What the last batch of the source that is kept has said; from any thread. When opened.
  std::string said(Source source) const;

  EventsState state() const override;
  Result<Page> Read(const PageQuery& query) const override;

 private:
  void Run();
  /// Until there is something to be written, or it is time to look.
  bool Sleep();
  void WriteDue();
  Status Open();
  void Show(Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);

  const Options options_;
  EventFile file_;  // of the writing thread
  mutable Mutex mutex_;
  std::condition_variable due_;
  EventBook book_ BAUDGATE_GUARDED_BY(mutex_);
  bool opened_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::function<void()> tell_opened_ BAUDGATE_GUARDED_BY(mutex_);
  EventsState state_ BAUDGATE_GUARDED_BY(mutex_);
  bool stop_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace baudgate::events
