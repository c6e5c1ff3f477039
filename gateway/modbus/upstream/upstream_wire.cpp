// Which request goes to the server next, and what its replies say.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/modbus/upstream/upstream_link.h"
#include "gateway/modbus/wire/mbap.h"
#include "gateway/modbus/wire/request.h"

namespace baudgate::modbus {
namespace {

constexpr std::size_t kShownOfReply = 16;  // bytes, in a reason

}  // namespace

void Upstream::Link::Pump(Instant now) {
  while (connection_ && on_wire_.size() < kMostOnWire) {
    RouteQueue::Batch batch = Choose(now);
    if (batch.empty()) return;
    Send(now, std::move(batch));
  }
}

/// A unit that does not answer takes neither all places nor, in the end, more than one.
bool Upstream::Link::HasRoom(std::uint8_t unit) const {
  if (on_wire_.size() >= kMostOnWire - kKeptForWrites) return false;
  const auto count = std::ranges::count(on_wire_, unit, &Sent::unit);
  return count < (ignored_[unit] < kSilentDeadlines ? static_cast<int>(kMostPerUnit) : 1);
}

/// The server has not closed yet because of the request that is repeated, and may.
bool Upstream::Link::IsTryingOut(Instant now) const {
  return std::ranges::any_of(
      on_wire_, [now](const Sent& sent) { return sent.repeated() && now < sent.at + kTriedOut; });
}

RouteQueue::Batch Upstream::Link::Choose(Instant now) {
  const auto no_write = [this](const RoutedRequest& request) {
    return std::ranges::none_of(on_wire_, [&request](const Sent& sent) {
      return !sent.only_reads() && (request.broadcast || sent.unit == request.slave);
    });
  };
  const bool trying_out = IsTryingOut(now);
  const auto may_ask = [&](const RoutedRequest& request) {
    if (trying_out && request.tries > 0) return false;
    return HasRoom(request.slave) && no_write(request);
  };
  RouteQueue::Batch batch = queue_.TakeUrgent(no_write);
  for (const auto priority :
       {config::Priority::high, config::Priority::normal, config::Priority::low}) {
    if (batch.empty()) batch = queue_.Take(priority, may_ask);
  }
  waiting_ -= batch.size();
  return batch;
}

std::uint16_t Upstream::Link::FreeId() {
  const auto taken = [this] {
    return std::ranges::any_of(on_wire_, [this](const Sent& sent) { return sent.id == next_id_; });
  };
  while (taken()) ++next_id_;
  return next_id_++;
}

void Upstream::Link::Send(Instant now, RouteQueue::Batch batch) {
  Sent sent;
  sent.id = FreeId();
  sent.unit = batch[0].slave;
  sent.pdu = batch[0].pdu;
  sent.at = now;
  for (const RoutedRequest& request : batch) {
    sent.deadline = std::max(sent.deadline, request.deadline);
  }
  const Status status = connection_->Send(AduOf(sent.id, sent.unit, batch[0].pdu));
  const bool over = status.ok() && batch[0].broadcast;
  sent.requests = std::move(batch);
  if (over) return AnswerSent(sent, Outcome::ok, {}, "");
  on_wire_.push_back(std::move(sent));
  if (!status) Break(status.error());
}

std::size_t Upstream::Link::LengthOf(View head, std::size_t told) const {
  const std::uint16_t id = TransactionOf(head);
  const auto asked =
      std::ranges::find_if(on_wire_, [id](const Sent& sent) { return sent.id == id; });
  const bool known = asked != on_wire_.end() && asked->unit == UnitOf(head);
  return LengthOfReply(known ? View(asked->pdu) : View(), PduOf(head), told);
}

void Upstream::Link::OnFrame(View frame) {
  silent_ = 0;
  const std::uint8_t unit = UnitOf(frame);
  ignored_[unit] = 0;
  pauses_.OnAnswer(unit);
  const std::uint16_t id = *ByteReader(frame).U16Be(0);
  const auto found =
      std::ranges::find_if(on_wire_, [id](const Sent& sent) { return sent.id == id; });
  if (found == on_wire_.end()) {
    if (std::erase(expired_, Expired{id, unit}) > 0) on_late_(unit);
    return;
  }
  const Sent sent = std::move(*found);
  on_wire_.erase(found);
  if (unit != sent.unit) {
    AnswerSent(sent, Outcome::unexpected, {}, name_ + " answered for unit " + std::to_string(unit));
    return;
  }
  // Its id says that it answers this request: of whatever form it is, its client judges.
  const View pdu = PduOf(frame);
  const bool refused = pdu[0] == (sent.function() | kExceptionBit) && pdu.size() == 2;
  if (refused) return AnswerSent(sent, Outcome::refused, pdu, "");
  if (pdu[0] == sent.function()) return AnswerSent(sent, Outcome::ok, pdu, "");
  AnswerSent(sent, Outcome::unexpected, {},
             name_ + " sent an answer that does not fit the request: " +
                 ToHex(pdu.first(std::min(pdu.size(), kShownOfReply))));
}

}  // namespace baudgate::modbus
