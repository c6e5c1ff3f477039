// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/upstream/requests_on_wire.h"

#include <iterator>

#include "gateway/base/time.h"

namespace baudgate::modbus {
namespace {

constexpr std::size_t kMostExpired = 64;

}  // namespace

void RequestsOnWire::Sent::Answer(Outcome outcome, View pdu, const std::string& reason) const {
  const bool unknown = outcome == Outcome::no_reply && !only_reads();
  for (std::size_t i = 0; i < requests.size(); ++i) {
    bus::RoutedReply reply;
    reply.outcome = outcome;
    reply.pdu = Bytes(pdu.begin(), pdu.end());
    reply.reason = reason + (unknown ? "; the request may have been carried out" : "");
    reply.sent = true;
    reply.shared = i > 0;
    reply.waited = at - requests[i].arrived;
    requests[i].done(std::move(reply));
  }
}

void RequestsOnWire::OnConnecting(Instant now) {
  silent_ = 0;
  silent_from_ = now;
  expired_.clear();
}

bool RequestsOnWire::HasRoom(std::uint8_t unit) const {
  if (sent_.size() >= kMost - kKeptForWrites) return false;
  const auto count = std::ranges::count(sent_, unit, &Sent::unit);
  return count < (ignored_[unit] < kSilentDeadlines ? static_cast<int>(kMostPerUnit) : 1);
}

bool RequestsOnWire::MayFollow(const bus::RoutedRequest& request) const {
  return std::ranges::none_of(sent_, [&request](const Sent& sent) {
    return !sent.only_reads() && (request.broadcast || sent.unit == request.slave);
  });
}

std::optional<Instant> RequestsOnWire::TriedOutAt(Instant now) const {
  std::optional<Instant> soonest;
  for (const Sent& sent : sent_) {
    const Instant at = sent.at + kTriedOut;
    if (sent.repeated() && at > now) soonest = Soonest({soonest, at});
  }
  return soonest;
}

RequestsOnWire::Sent RequestsOnWire::Number(bus::RouteQueue::Batch batch, Instant now) {
  while (Find(next_id_) != sent_.end()) ++next_id_;
  Sent sent{next_id_++, batch[0].slave, batch[0].pdu, now, {}, {}};
  for (const bus::RoutedRequest& request : batch) {
    sent.deadline = std::max(sent.deadline, request.deadline);
  }
  sent.requests = std::move(batch);
  return sent;
}

View RequestsOnWire::PduOf(std::uint16_t id, std::uint8_t unit) const {
  const auto found = Find(id);
  return found != sent_.end() && found->unit == unit ? View(found->pdu) : View();
}

RequestsOnWire::Replied RequestsOnWire::TakeReplied(std::uint16_t id, std::uint8_t unit) {
  silent_ = 0;
  ignored_[unit] = 0;
  const auto found = std::ranges::find(sent_, id, &Sent::id);
  if (found == sent_.end()) return {.late = std::erase(expired_, Expired{id, unit}) > 0};
  Replied replied{.sent = std::move(*found)};
  sent_.erase(found);
  return replied;
}

std::vector<RequestsOnWire::Sent> RequestsOnWire::TakeExpired(Instant now) {
  std::vector<Sent> taken;
  for (Sent& sent : sent_) {
    const auto late = [now](const bus::RoutedRequest& request) { return request.deadline <= now; };
    const bool over = sent.deadline <= now;
    Sent expired{sent.id, sent.unit, sent.pdu, sent.at, sent.deadline, {}};
    std::ranges::copy_if(sent.requests, std::back_inserter(expired.requests), late);
    std::erase_if(sent.requests, late);
    if (over || !expired.requests.empty()) taken.push_back(std::move(expired));
    if (!over) continue;
    expired_.push_back({sent.id, sent.unit});
    ++ignored_[sent.unit];
    if (sent.at < silent_from_) continue;
    ++silent_;
    silent_from_ = now;
  }
  std::erase_if(sent_, [now](const Sent& sent) { return sent.deadline <= now; });
  if (expired_.size() > kMostExpired) {
    expired_.erase(expired_.begin(), expired_.end() - kMostExpired);
  }
  return taken;
}

bool RequestsOnWire::IsOfExpired(std::optional<std::uint16_t> id) const {
  return sent_.empty() || (id && std::ranges::find(expired_, *id, &Expired::id) != expired_.end());
}

std::optional<Instant> RequestsOnWire::Deadline() const {
  std::optional<Instant> soonest;
  for (const Sent& sent : sent_) {
    soonest = Soonest({soonest, sent.deadline});
    for (const bus::RoutedRequest& request : sent.requests) {
      soonest = Soonest({soonest, request.deadline});
    }
  }
  return soonest;
}

const RequestsOnWire::Sent* RequestsOnWire::Suspect() const {
  const Sent* suspect = nullptr;
  for (const Sent& sent : sent_) {
    if (sent.repeated() && (suspect == nullptr || sent.at >= suspect->at)) suspect = &sent;
  }
  return suspect;
}

std::vector<bus::RouteQueue::Batch> RequestsOnWire::TakeReads(const Sent* reason) {
  std::vector<bus::RouteQueue::Batch> reads;
  for (auto sent = sent_.rbegin(); sent != sent_.rend(); ++sent) {
    const bool again = reason == nullptr && sent->repeated();
    if (!sent->only_reads() || again || &*sent == reason) continue;
    if (reason == nullptr) {
      for (bus::RoutedRequest& request : sent->requests) ++request.tries;
    }
    reads.push_back(std::exchange(sent->requests, {}));
  }
  return reads;
}

void RequestsOnWire::Abandon(std::uint64_t client) {
  for (Sent& sent : sent_) {
    std::erase_if(sent.requests, [client](const bus::RoutedRequest& request) {
      if (request.client == client) request.done(bus::Abandoned(true));
      return request.client == client;
    });
  }
}

}  // namespace baudgate::modbus
