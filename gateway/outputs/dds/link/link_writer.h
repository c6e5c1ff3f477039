// The SampleWriter that sends samples to the process that speaks DDS. It never waits and keeps
// empty: what does not fit into the socket now is wanted later.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <condition_variable>
#include <functional>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

/// The publisher's thread writes; gateway/outputs/dds/link/process_link.h attaches and detaches
/// processes from its own.
class LinkWriter : public SampleWriter {
 public:
  explicit LinkWriter(LinkOpen open = {}) : open_(std::move(open)) {}

  Sent Write(const PointSample& sample) override;
  Sent Write(const DeviceSample& sample) override;
  Sent Write(const GatewaySample& sample) override;
  Sent Write(const EventSample& sample) override;
  Sent Write(const AlarmSample& sample) override;
  Sent Write(const ReplySample& reply) override;
  /// Tells the process that this is the end, and waits until it has left: longer by what it needs
  /// for the ends of the points and for its own goodbye.
  bool WaitAcknowledged(Duration most) override;
  Sent Reopen(const Room& room) override;
  Subscribers subscribers() const override;
  std::uint64_t session() const override;
  void OnSession(const std::function<void()>& changed) override;
  void OnRequest(TakeRequest take) override;

  /// The request to open that the next process gets, with the room of the latest Reopen.
  LinkOpen open() const;
  /// Sends samples to `socket` from now on; the caller keeps it open until Detach. A second call
  /// with the same socket means that the process has replaced its writers.
  void Attach(int socket);
  void Detach();
  void SetSubscribers(const Subscribers& subscribers);
  /// The process has left, and subscribers have everything.
  void SetLeft();
  /// From the process.
  void HandOn(WriteArrival arrival) const;
  /// The end has been told.
  bool ending() const;

 private:
  template <typename Sample>
  Sent Put(LinkKind kind, const Sample& sample);
  Sent SendHeld(std::size_t size) BAUDGATE_REQUIRES(mutex_);
  void TellSession() const;

  mutable Mutex mutex_;
  LinkOpen open_ BAUDGATE_GUARDED_BY(mutex_);
  std::condition_variable detached_;
  int socket_ BAUDGATE_GUARDED_BY(mutex_) = -1;
  std::uint64_t sessions_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  Subscribers subscribers_ BAUDGATE_GUARDED_BY(mutex_);
  bool ending_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool left_ BAUDGATE_GUARDED_BY(mutex_) = false;
  /// The process was asked to replace its writers and has not answered yet. Nothing is sent
  /// meanwhile, because the order of events would change: the oldest ones are sent again
  /// afterwards.
  bool reopening_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::array<std::uint8_t, kMaxLinkMessage> packet_ BAUDGATE_GUARDED_BY(mutex_){};
  mutable Mutex telling_;
  std::function<void()> on_session_ BAUDGATE_GUARDED_BY(telling_);
  TakeRequest on_request_ BAUDGATE_GUARDED_BY(telling_);
};

}  // namespace baudgate::dds
