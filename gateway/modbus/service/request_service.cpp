// Requests that are answered here, and the keeping of those that wait. Routed requests and
// broadcasts: request_routing.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/service/request_service.h"

#include <algorithm>
#include <utility>

#include "gateway/base/deadline.h"
#include "gateway/modbus/service/permission.h"
#include "gateway/modbus/service/write_exception.h"

namespace baudgate::modbus {
namespace {

constexpr const char* kNotPermitted = "the listener does not permit it";
constexpr const char* kTooMany = "this client has 32 unanswered requests already";
static_assert(RequestService::kMaxPending == 32);

/// What a listener says in its own name when nothing better can be had; silent ones keep it.
bool IsGatewayTrouble(ExceptionCode exception) {
  return exception == kNoPath || exception == kNoTarget || exception == kBusy;
}

}  // namespace

RequestService::RequestService(const config::Listener& listener, ServerShared& shared, Wire& wire,
                               const std::string& peer, config::Priority priority, const Now& now)
    : listener_(listener),
      shared_(shared),
      wire_(wire),
      priority_(priority),
      record_(shared.book()->Enter(peer, listener, priority, now.wall)) {}

void RequestService::Handle(View frame, const Now& now) {
  LiveCounters::Add(shared_.counters().requests);
  ClientRecord::Add(record_->requests);
  ClientRecord::Add(record_->bytes_in, BytesOnWire(frame.size()));
  record_->last_request.store(now.instant, std::memory_order_relaxed);
  const Way way = shared_.WayOf(UnitOf(frame));
  if (way.kind == Way::Kind::none) return Refuse(frame, kNoPath, now.instant);
  if (!Permits(listener_.permit, FunctionOf(frame))) {
    const bool routed = way.kind == Way::Kind::route;
    const auto witness = routed ? WitnessOf(frame, shared_.targets().of(way.route), now) : nullptr;
    if (witness) witness->Deny(WriteEnd::denied, kNotPermitted);
    if (routed) {
      shared_.book()->Asked(way.route, UnitOf(frame));
      shared_.book()->Ended(way.route, UnitOf(frame), RouteOutcome::denied, {}, now.wall);
    }
    const bool gateway = way.kind == Way::Kind::gateway && UnitOf(frame) != 0;
    if (way.kind == Way::Kind::device || gateway) {
      shared_.units().Deny(frame, writer(), {.end = WriteEnd::denied, .reason = kNotPermitted},
                           now);
    }
    return Refuse(frame, kIllegalFunction, now.instant);
  }
  if (way.kind == Way::Kind::route) return HandleRouted(frame, way.route, now);
  if (UnitOf(frame) == 0 && IsPlainWrite(FunctionOf(frame))) {
    return HandleBroadcast(frame, TrafficBook::kBroadcasts, shared_.targets().lines(), now);
  }
  HandleOwn(frame, now);
}

void RequestService::HandleOwn(View frame, const Now& now) {
  ModbusRequest request;
  ExceptionCode exception = shared_.units().Check(frame, request);
  if (exception != kNoException) return Refuse(frame, exception, now.instant);
  const bool write = IsPlainWrite(request.function);
  if (write && pending_.size() + broadcasts_ >= kMaxPending) {
    shared_.units().Deny(frame, writer(), {.end = WriteEnd::busy, .reason = kTooMany}, now);
    return Refuse(frame, kBusy, now.instant);
  }
  exception = write ? StartWrite(request, now.instant)
                    : shared_.units().Read(request, listener_.holes, now.instant, record_->id);
  if (exception != kNoException) return Refuse(frame, exception, now.instant);
  if (!write) Answer(request, now.instant);
}

ExceptionCode RequestService::StartWrite(const ModbusRequest& request, Instant now) {
  const std::uint64_t number = next_number_++;
  const Instant deadline = now + shared_.limits().write_deadline;
  auto done = [inbox = shared_.inbox(), service = weak_from_this(),
               number](const WriteResult& result) {
    inbox->Post([service, number, result](const Now& now) {
      if (const auto self = service.lock()) self->FinishWrite(number, result, now.instant);
    });
  };
  if (!abandoned_) abandoned_ = std::make_shared<std::atomic<bool>>(false);
  const auto exception =
      shared_.units().Submit(request, {writer(), deadline, abandoned_}, now, std::move(done));
  if (exception == kNoException) {
    AddPending({number, deadline, {}, CopyOf(request.frame.first(kMbapHeader + kWriteReply))});
  }
  return exception;
}

void RequestService::FinishWrite(std::uint64_t number, const WriteResult& result, Instant now) {
  const auto pending = TakePending(number);
  if (!pending || pending->abandoned) return;
  const View asked = pending->frame;
  const ExceptionCode exception = ExceptionOf(result);
  if (exception != kNoException) return Refuse(asked, exception, now);
  Answer(AduOf(TransactionOf(asked), UnitOf(asked), PduOf(asked)), now);
}

void RequestService::Sweep(const Now& now) {
  std::vector<std::pair<std::uint64_t, bool>> late;
  for (const Pending& pending : pending_) {
    if (now.instant >= pending.Limit())
      late.emplace_back(pending.number, pending.route.has_value());
  }
  const auto self = shared_from_this();
  RoutedReply nothing;
  nothing.outcome = Outcome::no_reply;
  nothing.reason = "no result was known when its deadline passed";
  nothing.sent = true;  // for all that is known
  for (const auto& [number, routed] : late) {
    if (routed) {
      FinishRouted(number, nothing, now);
    } else {
      FinishWrite(number, {.end = WriteEnd::unknown}, now.instant);
    }
  }
}

std::optional<Instant> RequestService::Deadline() const {
  std::optional<Instant> next;
  for (const Pending& pending : pending_) next = Soonest({next, pending.Limit()});
  return next;
}

/// Targets may still hold what the sweep has answered in their place.
void RequestService::Abandon() {
  for (RouteTarget* target : std::exchange(used_, {})) target->Abandon(record_->id);
  if (abandoned_) std::exchange(abandoned_, nullptr)->store(true);
  for (Pending& pending : pending_) pending.abandoned = true;
  const auto routed =
      std::stable_partition(pending_.begin(), pending_.end(),
                            [](const Pending& pending) { return !pending.route.has_value(); });
  std::for_each(routed, pending_.end(), [this](const Pending& pending) {
    shared_.book()->Ended(*pending.route, UnitOf(pending.frame), RouteOutcome::abandoned, {}, {});
  });
  pending_.erase(routed, pending_.end());
  record_->outstanding.store(static_cast<std::uint32_t>(pending_.size()),
                             std::memory_order_relaxed);
}

void RequestService::Close() {
  if (closed_) return;
  closed_ = true;
  Abandon();
  pending_.clear();
  shared_.units().Forget(writer());
  shared_.book()->Leave(*record_);
}

void RequestService::AddPending(Pending pending) {
  wire_.SweepAt(pending.Limit());
  pending_.push_back(std::move(pending));
  record_->outstanding.store(static_cast<std::uint32_t>(pending_.size()),
                             std::memory_order_relaxed);
}

std::optional<RequestService::Pending> RequestService::TakePending(std::uint64_t number) {
  const auto found = std::ranges::find(pending_, number, &Pending::number);
  if (found == pending_.end()) return std::nullopt;
  Pending pending = std::move(*found);
  pending_.erase(found);
  record_->outstanding.store(static_cast<std::uint32_t>(pending_.size()),
                             std::memory_order_relaxed);
  return pending;
}

/// On a serial wire a write to unit 0 goes to all, wherever a route may lead it: its sender waits
/// for no answer, and would take one for the reply to its next request.
bool RequestService::IsUnawaited(View request) const {
  return listener_.speaks_serial() && UnitOf(request) == 0 && IsPlainWrite(FunctionOf(request));
}

std::size_t RequestService::BytesOnWire(std::size_t frame) const {
  constexpr std::size_t kRtuFrame = 3;    // address and CRC
  constexpr std::size_t kAsciiFrame = 3;  // colon, CR and LF; around address, PDU and LRC in hex
  const std::size_t pdu = frame - kMbapHeader;
  switch (listener_.framing) {
    case Framing::tcp:
      break;
    case Framing::rtu:
      return pdu + kRtuFrame;
    case Framing::ascii:
      return 2 * (pdu + 2) + kAsciiFrame;
  }
  return frame;
}

void RequestService::Answer(const ModbusRequest& request, Instant now) {
  ClientRecord::Add(record_->bytes_out, BytesOnWire(ReplySize(request)));
  record_->functions->Add(request.function);
  wire_.Answer(request, shared_.units().responder(), now);
}

void RequestService::Answer(View frame, Instant now) {
  ClientRecord::Add(record_->bytes_out, BytesOnWire(frame.size()));
  const std::uint8_t function = FunctionOf(frame);
  const bool refused = (function & kExceptionBit) != 0 && frame.size() > kMbapHeader + 1;
  record_->functions->Add(function & ~kExceptionBit, refused ? frame[kMbapHeader + 1] : 0);
  wire_.Answer(frame, now);
}

void RequestService::Refuse(View frame, ExceptionCode exception, Instant now) {
  const bool silent = listener_.errors == config::Listener::Errors::silent;
  const bool kept = silent && IsGatewayTrouble(exception);
  if (kept || IsUnawaited(frame)) return wire_.AnswerNothing(now);
  LiveCounters::Add(shared_.counters().exceptions);
  ClientRecord::Add(record_->exceptions);
  Answer(ExceptionReply(frame, exception), now);
}

}  // namespace baudgate::modbus
