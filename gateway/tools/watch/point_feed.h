// The subscriber of `watch`: points, starts and ends of gateways on their way from the library's
// threads to the one that shows them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/participant_options.h"
#include "gateway/tools/watch/mailbox.h"
#include "gateway/tools/watch/watch_lines.h"

namespace baudgate {

struct GatewayStart {
  dds::GatewaySample sample;
  dds::PublisherId publisher;
};
using HeardEvent = std::variant<PointEvent, GatewayStart, dds::PublisherId>;  ///< the last has left

class PointFeed {
 public:
  explicit PointFeed(dds::ParticipantOptions participant) : participant_(std::move(participant)) {}
  ~PointFeed() { Close(); }
  PointFeed(const PointFeed&) = delete;
  PointFeed& operator=(const PointFeed&) = delete;

  /// With another subscriber when there is one.
  Status Open();
  void Close();

  /// Readable when there is something to take.
  int descriptor() const { return mailbox_.descriptor(); }
  std::vector<HeardEvent> TakeAll() { return mailbox_.TakeAll(); }

  /// Samples so far that could not be read.
  std::uint64_t refused() const;
  /// Samples so far of points for which there was no room.
  std::uint64_t rejected() const { return rejected_before_ + rejected_; }

 private:
  dds::SubscriberCallbacks Callbacks();

  const dds::ParticipantOptions participant_;
  Mailbox<HeardEvent> mailbox_;
  std::atomic<std::uint64_t> rejected_ = 0;  ///< by this subscriber
  std::uint64_t rejected_before_ = 0;
  std::uint64_t refused_before_ = 0;
  std::unique_ptr<dds::DdsSubscriber> subscriber_;
};

}  // namespace baudgate
