// `DdsPublisher` publishes points and device states on DDS: on its thread, a SampleSender turns
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
  std::uint64_t events = 0;  ///< the part of `written` that were events
  std::uint64_t events_skipped = 0;  ///< events that were deleted before they could be sent
};

/// Decides which points and devices are sent now, in which batches and how fast, and sends the
/// final events. gateway/outputs/dds/publish_plan.h decides what is worth a sample. No thread, no
/// clock: DdsPublisher calls it with the time.
class SampleSender {
 public:
  /// The references and `events` must outlive this object. `now` is published as the gateway's
  /// start, and everything is due then. An image of more than 1000 points waits 500 ms, until
  /// running subscribers have found the gateway. `events`: null: there are none.
  SampleSender(const config::Config& config, const bus::PointStore& store, SampleWriter& writer,
               PacedWriter::Log log, Now now, EventSupply* events = nullptr);

  /// A new session has begun, whose writers contain no samples: everything is due at `now`. Unless
  /// SampleWriter::Reopen has caused it, this also forgets which points and devices were sent, and
  /// clears the queues of final samples.
  void StartAnew(Instant now);

  /// The configuration was reloaded. Order of sending: final samples of removed points and devices;
  /// then the writers are replaced, so that late subscribers never get the removed ones; then
  /// everything else, including unsent changes of Add.
  void OnReload(Instant now);

  /// Takes over changes, or none. To be called before each Send at which idle() is true, and only
  /// then.
  void Add(bus::Changes& changes);
  /// False: some changes of Add wait for the pacer.
  bool idle() const;
  /// Sends at the permitted rate: at most 64 notices of each kind, then the added changes, then at
  /// most 64 points and 64 devices that are due. Only while the writer has a session. Returns when
  /// to call it again at the latest; `now`: at once.
  Instant Send(Instant now);

  /// Sends the remaining events and alarms at the permitted rate. Returns when to call it again;
  /// empty: all were sent, or they cannot be sent. (baudgate-dds sends the final samples of
  /// points.)
  std::optional<Instant> End(Instant now) { return notices_.End(now); }
  /// Stores that subscribers have acknowledged everything; after End.
  void Confirm() { notices_.Confirm(); }

  /// Any thread may call it.
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
  /// What is being sent: points device by device, then devices.
  struct Round {
    std::vector<bus::PointRef> points;  ///< sorted by device
    std::size_t next_point = 0;
    std::vector<Staged> staged;  ///< points of one device; reused to avoid allocations
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
  Room room_;              ///< of the present writers
  bool reopen_ = false;    ///< SampleWriter::Reopen must be called
  bool reopened_ = false;  ///< Reopen was called, and the next session has not begun yet
  PointSlots slots_;
  PublishPlan plan_;
  PacedWriter paced_;
  NoticeSender notices_;
  Round round_;
  bool due_may_follow_ = false;
  std::vector<std::uint32_t> due_;  ///< reused memory
  DeviceSample device_sample_;      ///< reused memory
};

struct DdsCounters : SampleCounters {
  Subscribers subscribers;
  DatagramCounters datagrams{};
};

class DdsPublisher {
 public:
  /// Called on the publisher's thread.
  using Log = PacedWriter::Log;

  /// Starts to publish to `writer`: first everything, then changes; everything again for each new
  /// session. `config` and `store` must outlive the publisher. To be called before the lines start.
  /// `events`: null: there are none. An error contains the name that is too long.
  static Result<std::unique_ptr<DdsPublisher>> Create(const config::Config& config,
                                                      bus::PointStore& store,
                                                      std::shared_ptr<SampleWriter> writer,
                                                      Log log = {},
                                                      std::shared_ptr<EventSupply> events = {});
  ~DdsPublisher();

  /// An error contains the first name that is too long to be published.
  static Status CheckNames(const config::Config& config);

  /// To be called after a reload has changed the store.
  void OnReload();
  /// Sends the last events and ends the thread, after baudgate-dds has published that all points
  /// are gone, or after two seconds at most. Idempotent.
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
  std::shared_ptr<EventSupply> events_;  // null: there are none
  std::shared_ptr<bus::ChangeFeed> feed_;
  SampleSender sender_;
  std::atomic<bool> reloaded_ = false;
  // Used by the publisher's thread only.
  Pacer wakes_;
  bus::Changes changes_;
  std::uint64_t session_ = 0;  // of sender_; 0: none
  Instant next_sending_{};
  Instant rests_until_{};
  Worker worker_;
};

}  // namespace baudgate::dds
