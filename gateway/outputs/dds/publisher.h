// Publishes points and device states on DDS: the thread on which SampleSender takes changes from
// the point store and writes samples. Lines never wait for it.
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

// From the point store to samples: which points and devices are sent now, in which batches, how
// fast, and what is told at the end. Asks gateway/outputs/dds/publish_plan.h what is worth a
// sample. Sans-I/O: time is an argument; DdsPublisher drives it on a thread.
struct SampleCounters {
  std::uint64_t written = 0;
  std::uint64_t failed = 0;  ///< samples that the library did not take; they are tried again
  std::uint64_t events = 0;  ///< of `written`
  std::uint64_t events_skipped = 0;  ///< that were no longer to be had
};

class SampleSender {
 public:
  /// All outlive the sender; it is asked to Send only while the writer has a session. `now` is told
  /// as the gateway's start. Everything is due then: the start-up image. A long image waits 500 ms,
  /// until subscribers that are already there have found the gateway.
  /// `events`: null: there are none.
  SampleSender(const config::Config& config, const bus::PointStore& store, SampleWriter& writer,
               PacedWriter::Log log, Now now, EventSupply* events = nullptr);

  /// A new session has begun, whose writers hold no samples: everything is due at `now`. It also
  /// forgets which points and devices were sent and which ends are to be sent, unless the session
  /// has begun by SampleWriter::Reopen.
  void StartAnew(Instant now);

  /// The configuration was reloaded, and the store may have other devices. First come the ends of
  /// removed points and devices. Then the writers are replaced, so that late subscribers never get
  /// these. Then everything else is sent again, also what was given to Add and is not sent yet.
  void OnReload(Instant now);

  /// Takes over what has changed; also when nothing has. Only while idle, and before each Send
  /// then.
  void Add(bus::Changes& changes);
  /// Everything added has been sent; false: the pace holds some of it back.
  bool idle() const;
  /// Sends at most 64 ends of points, events and alarms, what was added, then at most 64 points and
  /// 64 devices that are due by themselves, as far as the pace allows. Returns when to call it
  /// again at the latest; `now`: at once.
  Instant Send(Instant now);

  /// Sends the events and alarms until now, as far as the pace allows. Returns when to go on;
  /// empty: all are sent, or cannot be. The end of the points is told by the DDS process.
  std::optional<Instant> End(Instant now) { return notices_.End(now); }
  /// Behind End: subscribers have confirmed everything.
  void Confirm() { notices_.Confirm(); }

  /// From any thread.
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
    std::vector<Staged> staged;  ///< of one device; its memory is kept
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
  Room room_;              ///< that the writer has
  bool reopen_ = false;    ///< SampleWriter::Reopen is to be called
  bool reopened_ = false;  ///< it was called, and the next session has not begun yet
  PointSlots slots_;
  PublishPlan plan_;
  PacedWriter paced_;
  NoticeSender notices_;
  Round round_;
  bool due_may_follow_ = false;
  std::vector<std::uint32_t> due_;  ///< kept to save its memory
  DeviceSample device_sample_;      ///< so is this
};

struct DdsCounters : SampleCounters {
  Subscribers subscribers;
  DatagramCounters datagrams{};
};

class DdsPublisher {
 public:
  /// Called on the publisher's thread.
  using Log = PacedWriter::Log;

  /// Starts publishing to `writer`: everything to each that takes samples there, then what changes.
  /// `config` and `store` outlive it; call before the lines start. `events`: null: there are none.
  /// The error says which name to change.
  static Result<std::unique_ptr<DdsPublisher>> Create(const config::Config& config,
                                                      bus::PointStore& store,
                                                      std::shared_ptr<SampleWriter> writer,
                                                      Log log = {},
                                                      std::shared_ptr<EventSupply> events = {});
  ~DdsPublisher();

  /// Which name is too long to be published.
  static Status CheckNames(const config::Config& config);

  /// A reload: the store has other devices; taken in soon.
  void OnReload();
  /// Hands over the last events, and ends when the DDS process has told subscribers that all points
  /// are gone; within two seconds. Idempotent.
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
  // Used by the thread.
  Pacer wakes_;
  bus::Changes changes_;
  std::uint64_t session_ = 0;  // whom the sender sends to
  Instant next_sending_{};
  Instant rests_until_{};
  Worker worker_;
};

}  // namespace baudgate::dds
