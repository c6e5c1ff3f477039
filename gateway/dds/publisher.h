// Publishes points and device states on DDS: takes changes from the point store, asks the publish
// plan, writes samples. Everything happens on a thread of its own; lines never wait for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/dds/publish_plan.h"
#include "gateway/dds/sample_writer.h"
#include "gateway/dds/samples.h"
#include "gateway/store/change_feed.h"
#include "gateway/store/point_store.h"

namespace baudgate::dds {

struct DdsCounters {
  std::uint64_t written = 0;      ///< samples
  std::uint64_t failed = 0;       ///< samples that the library did not take; they are tried again
  std::uint32_t subscribers = 0;  ///< readers of the points topic, now
};

class DdsPublisher {
 public:
  /// One line for people, at a change only; called on the publisher's thread.
  using Log = std::function<void(const std::string& line)>;

  /// Starts publishing. `config` and `store` outlive it; call before the lines start.
  /// The error says what in `dds:` or which name to change.
  static Result<std::unique_ptr<DdsPublisher>> Create(const config::Config& config,
                                                      PointStore& store, Log log = {});
  /// The same with another place for the samples to go.
  static Result<std::unique_ptr<DdsPublisher>> Create(const config::Config& config,
                                                      PointStore& store, Log log,
                                                      std::unique_ptr<SampleWriter> writer);
  ~DdsPublisher();

  /// Tells subscribers that all points are gone and ends; within about a second. Idempotent.
  void Stop();

  DdsCounters counters() const;

 private:
  struct Staged {
    std::uint32_t slot = 0;
    PointState state;
    PointSample sample;
  };

  DdsPublisher(const config::Config& config, PointStore& store, Log log,
               std::unique_ptr<SampleWriter> writer);

  void Run();
  void SendChanges();
  void SendDue();
  void SendPoints(std::span<const PointRef> refs);
  void StagePoints(std::uint32_t device, std::span<const PointRef> refs);
  void SendDevice(std::uint32_t device);
  void FillPoint(const DeviceRecord& record, std::uint32_t point, Staged& staged) const;
  void FillDevice(const DeviceRecord& record);
  void DisposeAll();
  void Count(bool written, const std::string& device);
  /// False when the publisher is to stop.
  bool Pace();
  bool WaitUntil(Instant when);
  bool stopping() const;
  PointRef RefOf(std::uint32_t slot) const;

  const config::Config& config_;
  PointStore& store_;
  Log log_;
  std::unique_ptr<SampleWriter> writer_;
  std::shared_ptr<ChangeFeed> feed_;
  std::vector<std::uint32_t> first_slot_;  ///< by device, and one more: the number of points
  PublishPlan plan_;
  Pacer pacer_;

  // Of the publisher's thread, kept to save their memory.
  Changes changes_;
  std::vector<std::uint32_t> due_;
  std::vector<PointRef> due_refs_;
  std::vector<Staged> staged_;
  std::size_t staged_count_ = 0;
  DeviceSample device_sample_;
  std::uint64_t failing_ = 0;  ///< failures since the last success; the edge is logged

  std::atomic<std::uint64_t> written_ = 0;
  std::atomic<std::uint64_t> failed_ = 0;

  mutable std::mutex stop_mutex_;
  std::condition_variable stop_changed_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate::dds
