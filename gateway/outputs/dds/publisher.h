// `DdsPublisher` publishes points and device states, on its own thread; lines never wait for it.
// SampleSender turns changes into samples.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/notice_sender.h"
#include "gateway/outputs/dds/point_samples.h"
#include "gateway/outputs/dds/publish_plan.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

struct SampleCounters {
  std::uint64_t written = 0;
  std::uint64_t failed = 0;  ///< samples that the library did not accept; they are sent again
  std::uint64_t events = 0;  ///< the events among `written`
  std::uint64_t events_skipped = 0;  ///< events that were deleted before they could be sent
};

/// Decides which points and devices are sent now, in which batches and how fast, and sends the last
/// events at the end. No thread, no clock.
class SampleSender {
 public:
  /// The references and `events` must outlive this object. `now`: the gateway's start, when
  /// everything is due. More than 1000 points wait 500 ms, until subscribers have found the
  /// gateway.
  SampleSender(const config::Config& config, const bus::PointStore& store, SampleWriter& writer,
               PacedWriter::Log log, Now now, EventSupply* events = nullptr);

  /// Everything is due at `now`, because the new session's writers are empty. Unless Reopen has
  /// caused the session, this forgets what was sent, and clears the queues of final samples.
  void StartAnew(Instant now);

  /// Sends final samples of removed points and devices; then replaces the writers, so that late
  /// subscribers never get the removed points; then sends everything else.
  void OnReload(Instant now);

  /// Takes over changes (possibly none). To be called before each Send if and only if idle().
  void Add(bus::Changes& changes);
  /// False: some changes of Add have not been sent yet.
  bool idle() const;
  /// Sends at most 64 notices of each kind, then the added changes, then at most 64 due points and
  /// 64 devices. Only while there is a session. Returns the latest time of the next call.
  Instant Send(Instant now);

  /// Returns the time of the next call; nothing: all were sent, or they cannot be sent. The final
  /// samples of points are sent by baudgate-dds.
  std::optional<Instant> End(Instant now) { return notices_.End(now); }
  void Confirm() { notices_.Confirm(); }

  SampleCounters counters() const {
    return {.written = paced_.written(),
            .failed = paced_.failed(),
            .events = notices_.events().sent(),
            .events_skipped = notices_.events().skipped()};
  }

 private:
  struct Staged {
    std::uint32_t slot = 0;
    PointState state;
    PointSample sample;
  };
  /// The samples that are being sent: points device by device, then devices.
  struct Round {
    std::vector<bus::PointRef> points;  ///< changed points, sorted by device
    std::size_t next_point = 0;
    std::vector<Staged> staged;  ///< samples of points of one device; reused to avoid allocations
    std::size_t staged_count = 0;
    std::size_t next_staged = 0;
    std::vector<std::uint32_t> devices;
    std::size_t next_device = 0;
  };

  PublishPlan NewPlan(Instant now) const;
  void AddEnds(const PointSlots& before);
  bool Reopen();
  bool SendRound(Instant now);
  void TakeDue(Instant now);
  void StageNextDevice(Instant now);
  bool SendStaged(Instant now);
  void Unstage();
  bool SendDevice(std::uint32_t device, Instant now);

  const config::Config& config_;
  const bus::PointStore& store_;
  SampleWriter& writer_;
  Room room_;              ///< space of the present writers
  bool reopen_ = false;    ///< the writers must be replaced by SampleWriter::Reopen
  bool reopened_ = false;  ///< Reopen was called, and the new session has not begun yet
  PointSlots slots_;
  PublishPlan plan_;
  PacedWriter paced_;
  NoticeSender notices_;
  Round round_;
  bool due_may_follow_ = false;
  std::vector<std::uint32_t> due_;
  DeviceSample device_sample_;
};

struct DdsCounters : SampleCounters {
  Subscribers subscribers;
  DatagramCounters datagrams{};
};

class DdsPublisher {
 public:
  /// Takes log lines, on the publisher's thread.
  using Log = PacedWriter::Log;

  /// Publishes everything, then changes; in each new session everything again. References must
  /// outlive the publisher. To be called before the lines start. An error contains a too long name.
  static Result<std::unique_ptr<DdsPublisher>> Create(const config::Config& config,
                                                      bus::PointStore& store,
                                                      std::shared_ptr<SampleWriter> writer,
                                                      Log log = {},
                                                      std::shared_ptr<EventSupply> events = {});
  ~DdsPublisher();

  static Status CheckNames(const config::Config& config);

  void OnReload();
  /// Sends the last events; ends the thread when baudgate-dds has published its final samples, or
  /// after two seconds. Can be repeated.
  void Stop();

  DdsCounters counters() const {
    return {sender_.counters(), writer_->subscribers(), writer_->datagrams()};
  }

 private:
  DdsPublisher(const config::Config& config, bus::PointStore& store, Log log,
               std::shared_ptr<SampleWriter> writer, std::shared_ptr<EventSupply> events);

  Instant Publish();
  void Renew(std::uint64_t session);
  Instant End();

  std::shared_ptr<SampleWriter> writer_;
  std::shared_ptr<EventSupply> events_;  // null: there are no events
  std::shared_ptr<bus::ChangeFeed> feed_;
  SampleSender sender_;
  std::atomic<bool> reloaded_ = false;
  // Only the publisher's thread uses the following members.
  Pacer wakes_;
  bus::Changes changes_;
  std::uint64_t session_ = 0;  // the session for which sender_ was started; 0: not started
  Instant next_sending_{};
  Instant rests_until_{};
  Worker worker_;
};

}  // namespace baudgate::dds
