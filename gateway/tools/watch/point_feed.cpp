// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/point_feed.h"

namespace baudgate {

namespace {

constexpr Duration kLookInterval = 1s;

}  // namespace

Listening::Listening(std::vector<std::string> interfaces, Open open, Find find)
    : interfaces_(std::move(interfaces)), open_(std::move(open)), find_(std::move(find)) {}

Status Listening::Start() {
  watched_.emplace(interfaces_, find_());
  return open_();
}

std::optional<std::string> Listening::Look(Instant now) {
  if (now < next_look_) return std::nullopt;
  next_look_ = now + kLookInterval;
  std::string told;
  if (!failure_) {
    const auto changed = watched_->Look(find_());
    if (!changed) return std::nullopt;
    told = *changed + "; ";
  }
  const Status status = Start();
  const auto before = std::exchange(failure_, std::nullopt);
  if (status) return told + "begun anew";
  failure_ = status.error();
  if (before == failure_) return std::nullopt;
  return told + *failure_;
}

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
