// Publishes points and device states on DDS: the thread on which
// gateway/outputs/dds/sample_sender.h takes changes from the point store and writes samples. Lines
// never wait for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/change_feed.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/pacer.h"
#include "gateway/outputs/dds/sample_sender.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

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
                                                      PointStore& store,
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
  DdsPublisher(const config::Config& config, PointStore& store, Log log,
               std::shared_ptr<SampleWriter> writer, std::shared_ptr<EventSupply> events);

  Instant Publish();
  void Renew(std::uint64_t session);
  Instant End();

  std::shared_ptr<SampleWriter> writer_;
  std::shared_ptr<EventSupply> events_;  // null: there are none
  std::shared_ptr<ChangeFeed> feed_;
  SampleSender sender_;
  std::atomic<bool> reloaded_ = false;
  // Used by the thread.
  Pacer wakes_;
  Changes changes_;
  std::uint64_t session_ = 0;  // whom the sender sends to
  Instant next_sending_{};
  Instant rests_until_{};
  Worker worker_;
};

}  // namespace baudgate::dds
