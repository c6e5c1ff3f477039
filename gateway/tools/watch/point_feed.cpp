// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/point_feed.h"

#include "gateway/tools/watch/listening.h"

namespace baudgate {

Status PointFeed::Open() {
  Close();
  mailbox_.TakeAll();  // of publishers that may have left meanwhile
  return MakeAnew(subscriber_, mailbox_, [this] {
    return dds::DdsSubscriber::Create({.participant = participant_}, Callbacks());
  });
}

/// The mailbox first, as in MakeAnew.
void PointFeed::Close() {
  mailbox_.Close();
  refused_before_ = refused();
  subscriber_.reset();
  rejected_before_ += rejected_.exchange(0);
}

std::uint64_t PointFeed::refused() const {
  return refused_before_ + (subscriber_ ? subscriber_->counters().refused : 0);
}

dds::SubscriberCallbacks PointFeed::Callbacks() {
  return {.on_point =
              [this](const dds::PointSample& sample, const dds::Origin& origin) {
                mailbox_.Put(PointEvent{sample, origin, {}});
              },
          .on_point_gone =
              [this](const dds::PointSample& sample, dds::Gone gone) {
                mailbox_.Put(PointEvent{sample, {}, gone});
              },
          .on_device = {},
          .on_device_gone = {},
          .on_gateway =
              [this](const dds::GatewaySample& sample, const dds::Origin& origin) {
                mailbox_.Put(GatewayStart{sample, origin.writer.publisher});
              },
          .on_gateway_gone = {},
          .on_gateways = {},
          .on_publisher_left = [this](const dds::PublisherId& id) { mailbox_.Put(id); },
          .on_rejected = [this](std::uint64_t samples) { rejected_ = samples; }};
}

}  // namespace baudgate
