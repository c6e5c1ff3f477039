// `DdsPublisher` publishes points and device states on DDS. On its thread, a SampleSender turns
// changes of the point store into samples. Lines never wait for it.
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

/// SampleSender decides which points and devices are sent now, in which batches and how fast, and
/// sends the last events at the end. gateway/outputs/dds/publish_plan.h decides whether a change is
/// sent. No thread, no clock: DdsPublisher calls it with the time.
class SampleSender {
 public:
  /// The references and `events` must outlive this object. `now` is published as the gateway's
  /// start, and all points and devices are due at that time. If there are more than 1000 points,
  /// they wait 500 ms, until running subscribers have found the gateway. `events` null: there are
  /// no events.
  SampleSender(const config::Config& config, const bus::PointStore& store, SampleWriter& writer,
               PacedWriter::Log log, Now now, EventSupply* events = nullptr);

  /// To be called when a new session (SampleWriter::session) has begun, whose writers contain no
  /// samples: everything is due at `now`. Unless SampleWriter::Reopen has caused the session,
  /// StartAnew also forgets which points and devices were sent, and clears the queues of final
  /// samples.
  void StartAnew(Instant now);

  /// To be called after a reload. If points or devices were removed or have no space, Send then
  /// sends the final samples and replaces the writers, so that late subscribers never get removed
  /// points. It sends everything else again.
  void OnReload(Instant now);

  /// Takes over changes (possibly none). To be called before each Send if idle() is true, and only
  /// then.
  void Add(bus::Changes& changes);
  /// False: some changes of Add have not been sent yet.
  bool idle() const;
  /// Sends at the permitted rate: at most 64 samples of each kind of NoticeSender, then the added
  /// changes, then at most 64 points and 64 devices that are due. To be called only while the
  /// writer has a session. Returns the latest time of the next call; `now`: immediately.
  Instant Send(Instant now);

  /// Sends the remaining events and alarms at the permitted rate. Returns the time of the next
  /// call; nothing: all samples were sent, or they cannot be sent. baudgate-dds sends the final
  /// samples of points.
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
    std::vector<bus::PointRef> points;  ///< changed or due points, sorted by device
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

  /// Starts to publish to `writer`: first everything, then changes; after each new session
  /// everything again. `config` and `store` must outlive the publisher. To be called before the
  /// lines start. `events` null: there are no events. An error contains the name that is too long.
  static Result<std::unique_ptr<DdsPublisher>> Create(const config::Config& config,
                                                      bus::PointStore& store,
                                                      std::shared_ptr<SampleWriter> writer,
                                                      Log log = {},
                                                      std::shared_ptr<EventSupply> events = {});
  ~DdsPublisher();

  static Status CheckNames(const config::Config& config);

  void OnReload();
  /// Sends the last events and ends the thread when baudgate-dds has published all points as not
  /// connected, after 2.2 s at most. A second call does nothing.
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
  std::shared_ptr<EventSupply> events_;
  std::shared_ptr<bus::ChangeFeed> feed_;
  SampleSender sender_;
  std::atomic<bool> reloaded_ = false;
  // Only the publisher's thread uses the following members.
  Pacer wakes_;
  bus::Changes changes_;
  // The session (SampleWriter::session) for which sender_ was started; 0: it was not started.
  std::uint64_t session_ = 0;
  Instant next_sending_{};
  Instant rests_until_{};
  Worker worker_;
};

}  // namespace baudgate::dds
