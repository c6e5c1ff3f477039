// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_server.h"

#include <algorithm>
#include <utility>

#include "gateway/base/value.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {
namespace {

constexpr Duration kSignOfLife = 1s;
// Shortest interval between two messages `counts` while the counts change.
constexpr Duration kAtMostEvery = 100ms;
// Time for four repetitions of lost samples: a subscriber requests lost samples after a heartbeat,
// and heartbeats are 100 ms apart.
constexpr Duration kAcknowledgeTime = 400ms;
constexpr Duration kEventRetry = 1s;
// Time in which the programs of subscribers take the last samples. Their DDS library acknowledges a
// sample before the program takes it, and drops samples that were not taken when the writer leaves.
constexpr Duration kTakingTime = 150ms;
// Most events, and most alarms, that wait for a retry.
constexpr std::size_t kMostEvents = 1000;
// Leave spreads the final samples over about this time: a burst would overflow the socket of a
// subscriber that waits for the processor, and repetitions can take longer than Leave waits.
// Examples: 1,000 points take 0.2 s; 10,000 points and more are sent at the usual rate, 20 per ms.
constexpr Duration kTellingTime = 500ms;
constexpr Duration kShortestInterval = 50us;
constexpr Duration kLongestInterval = 200us;
constexpr std::uint32_t kSlowBurst = 20;
constexpr std::uint32_t kUsualBurst = 100;

Pacer PacerOfEnds(std::size_t points) {
  const auto each = kTellingTime / static_cast<std::int64_t>(std::max<std::size_t>(points, 1));
  if (each <= kShortestInterval) return {kShortestInterval, kUsualBurst};
  return {std::min<Duration>(each, kLongestInterval), kSlowBurst};
}

}  // namespace

LinkServer::LinkServer(MakeWriter make, std::function<void()> wake)
    : make_(std::move(make)), requests_(std::move(wake)) {}

Status LinkServer::Take(View packet) {
  const auto message = ParseLink(packet);
  if (!message) return Error{"the gateway sent " + message.error()};
  if (message->kind == LinkKind::open) return Open(message->body);
  if (!writer_) return Error{"the gateway sent a message before its request to open DDS"};
  switch (message->kind) {
    case LinkKind::point: {
      const Status published = Publish(message->body, point_);
      if (published) Remember(message->body);
      return published;
    }
    case LinkKind::device:
      return Publish(message->body, device_);
    case LinkKind::gateway:
      return Publish(message->body, gateway_);
    case LinkKind::event:
      return PublishOnce(message->body, events_);
    case LinkKind::alarm:
      return PublishOnce(message->body, alarms_);
    case LinkKind::reply:
      return Reply(message->body);
    case LinkKind::end:
      ended_ = true;
      return {};
    default:
      return Error{"the gateway sent a message of an unexpected kind"};
  }
}

Status LinkServer::Open(View body) {
  const auto open = DecodeOpen(body);
  if (!open) return Error{"the gateway sent " + open.error()};
  if (writer_) return Reopen(open->room);
  auto writer = make_(*open);
  if (!writer) {
    answer_ = EncodeFailed(writer.error());
    return {};
  }
  writer_ = std::move(*writer);
  if (open->requests) {
    writer_->OnRequest([this](WriteArrival arrival) {
      const Instant now = arrival.received;
      requests_.Offer(std::move(arrival), now);
    });
  }
  answer_ = EncodeBare(LinkKind::opened);
  return {};
}

Status LinkServer::Reopen(const Room& room) {
  writer_->WaitAcknowledged(kAcknowledgeTime);
  if (writer_->Reopen(room) != Sent::yes) return Error{"DDS has no writers for these points"};
  answer_ = EncodeBare(LinkKind::opened);
  return {};
}

/// Stores `body`, the encoded form of point_, because Leave publishes the latest sample of each
/// point.
void LinkServer::Remember(View body) {
  const std::string name = point_.device + '\0' + point_.point;
  if (point_.quality == Quality(Quality::bad_not_connected).word()) {
    latest_.erase(name);
  } else {
    latest_[name].assign(body.begin(), body.end());
  }
}

std::optional<Instant> LinkServer::Leave(Instant now) {
  if (!writer_) return std::nullopt;
  if (!leave_by_) {
    leave_by_ = now + kEndTime;
    end_pacer_ = PacerOfEnds(latest_.size());
  }
  while (!latest_.empty() && now < *leave_by_) {
    if (!end_pacer_->Take(now)) return end_pacer_->ReadyAt();
    Decode(latest_.begin()->second, point_);
    point_.quality = Quality(Quality::bad_not_connected).word();
    writer_->Write(point_);
    latest_.erase(latest_.begin());
  }
  if (closes_at_) {
    if (now < *closes_at_) return closes_at_;
    writer_.reset();
    return std::nullopt;
  }
  if (std::exchange(acknowledged_, true)) return closes_at_ = now + kTakingTime;
  RetryEvents(events_retry_);
  const bool events_read = writer_->subscribers().events > 0;
  if (writer_->WaitAcknowledged(kAcknowledgeTime) && ended_ && events_read && events_.empty()) {
    answer_ = EncodeBare(LinkKind::left);
  }
  return now;
}

template <typename Sample>
Status LinkServer::Publish(View body, Sample& sample) {
  if (!Decode(body, sample)) return Error{"the gateway sent a damaged sample"};
  const Sent sent = writer_->Write(sample);
  ++(sent == Sent::yes ? counts_.written : counts_.refused);
  return {};
}

/// Publishes an event or alarm. If the library does not accept it, it is queued for a retry,
/// because the gateway sends it only once.
template <typename Sample>
Status LinkServer::PublishOnce(View body, std::deque<Sample>& held) {
  Sample sample;
  if (!Decode(body, sample)) return Error{"the gateway sent a damaged sample"};
  if (held.empty() && writer_->Write(sample) == Sent::yes) {
    ++counts_.written;
    return {};
  }
  if (held.size() == kMostEvents) {
    held.pop_front();
    ++counts_.events_dropped;
  }
  held.push_back(std::move(sample));
  return {};
}

template <typename Sample>
void LinkServer::Retry(std::deque<Sample>& held) {
  for (; !held.empty() && writer_->Write(held.front()) == Sent::yes; held.pop_front()) {
    ++counts_.written;
  }
}

void LinkServer::RetryEvents(Instant now) {
  if ((events_.empty() && alarms_.empty()) || now < events_retry_) return;
  Retry(events_);
  Retry(alarms_);
  events_retry_ = now + kEventRetry;
}

/// Publishes a reply. If the library does not accept it, it is dropped; the client repeats its
/// request.
Status LinkServer::Reply(View body) {
  ReplySample reply;
  if (!Decode(body, reply)) return Error{"the gateway sent a damaged reply"};
  writer_->Write(reply);
  return {};
}

std::optional<Bytes> LinkServer::NextRequest() {
  const auto arrival = requests_.Take();
  if (!arrival) return std::nullopt;
  return EncodeRequest(*arrival);
}

std::optional<Bytes> LinkServer::Answer(Instant now) {
  if (answer_) {
    told_at_ = now;
    return std::exchange(answer_, std::nullopt);
  }
  if (!writer_) return std::nullopt;
  RetryEvents(now);
  if (now < NextAnswer()) return std::nullopt;
  told_ = Counts();
  told_.datagrams = writer_->datagrams();
  told_.neighbours = writer_->neighbours();
  told_at_ = now;
  return EncodeCounts(told_);
}

Instant LinkServer::NextAnswer() const {
  if (answer_) return Instant();
  const LinkCounts now = Counts();
  const bool changed = now.subscribers != told_.subscribers || now.refused != told_.refused ||
                       now.events_dropped != told_.events_dropped;
  return told_at_ + (changed ? kAtMostEvery : kSignOfLife);
}

LinkCounts LinkServer::Counts() const {
  LinkCounts counts = counts_;
  counts.dropped = requests_.dropped();
  if (!writer_) return counts;
  counts.subscribers = writer_->subscribers();
  counts.dropped += writer_->dropped_requests();
  return counts;
}

}  // namespace baudgate::dds
