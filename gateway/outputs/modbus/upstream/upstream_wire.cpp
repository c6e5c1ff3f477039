// Which request goes to the server next, and what its replies say.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/upstream/upstream_link.h"
#include "gateway/outputs/modbus/wire/mbap.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {
namespace {

constexpr std::size_t kShownOfReply = 16;  // bytes, in a reason

}  // namespace

void Upstream::Link::Pump(Instant now) {
  while (connection_ && !on_wire_.full()) {
    RouteQueue::Batch batch = Choose(now);
    if (batch.empty()) return;
    Send(std::move(batch), now);
  }
}

RouteQueue::Batch Upstream::Link::Choose(Instant now) {
  const auto may_follow = [this](const RoutedRequest& request) {
    return on_wire_.MayFollow(request);
  };
  const bool trying_out = on_wire_.IsTryingOut(now);
  const auto may_ask = [&](const RoutedRequest& request) {
    if (trying_out && request.tries > 0) return false;
    return on_wire_.HasRoom(request.slave) && may_follow(request);
  };
  RouteQueue::Batch batch = queue_.TakeUrgent(may_follow);
  for (const auto priority :
       {config::Priority::high, config::Priority::normal, config::Priority::low}) {
    if (batch.empty()) batch = queue_.Take(priority, may_ask);
  }
  return batch;
}

void Upstream::Link::Send(RouteQueue::Batch batch, Instant now) {
  Sent sent = on_wire_.Number(std::move(batch), now);
  const Status status = connection_->Send(AduOf(sent.id, sent.unit, sent.pdu));
  if (status && sent.requests[0].broadcast) return sent.Answer(Outcome::ok, {}, "");
  on_wire_.Add(std::move(sent));
  if (!status) Break(status.error(), now);
}

std::size_t Upstream::Link::LengthOf(View head, std::size_t told) const {
  return LengthOfReply(on_wire_.PduOf(TransactionOf(head), UnitOf(head)), PduOf(head), told);
}

void Upstream::Link::OnFrame(View frame) {
  const std::uint8_t unit = UnitOf(frame);
  pauses_.OnAnswer(unit);
  const auto [sent, late] = on_wire_.TakeReplied(TransactionOf(frame), unit);
  if (late) on_late_(unit);
  if (!sent) return;
  if (unit != sent->unit) {
    return sent->Answer(Outcome::unexpected, {},
                        name_ + " answered for unit " + std::to_string(unit));
  }
  // Its id says that it answers this request: of whatever form it is, its client judges.
  const View pdu = PduOf(frame);
  const bool refused = pdu[0] == (sent->function() | kExceptionBit) && pdu.size() == 2;
  if (refused) return sent->Answer(Outcome::refused, pdu, "");
  if (pdu[0] == sent->function()) return sent->Answer(Outcome::ok, pdu, "");
  sent->Answer(Outcome::unexpected, {},
               name_ + " sent an answer that does not fit the request: " +
                   ToHex(pdu.first(std::min(pdu.size(), kShownOfReply))));
}

}  // namespace baudgate::modbus
