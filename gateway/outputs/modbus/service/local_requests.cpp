// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/local_requests.h"

#include <utility>

#include "gateway/outputs/modbus/service/write_exception.h"

namespace baudgate::modbus {
namespace {

constexpr const char* kTooMany = "this client has 32 unanswered requests already";
static_assert(PendingRequests::kMost == 32);

}  // namespace

LocalRequests::LocalRequests(const config::Listener& listener, LocalUnits& units,
                             std::shared_ptr<Inbox> inbox, std::shared_ptr<ClientReplies> replies,
                             Duration write_deadline)
    : listener_(listener),
      units_(units),
      inbox_(std::move(inbox)),
      replies_(std::move(replies)),
      write_deadline_(write_deadline) {}

void LocalRequests::Handle(View frame, bool has_room, const Now& now) {
  ModbusRequest request;
  ExceptionCode exception = units_.Check(frame, request);
  if (exception != kNoException) return replies_->Refuse(frame, exception, now.instant);
  const bool write = IsPlainWrite(request.function);
  const Writer& client = replies_->client();
  if (write && !has_room) {
    units_.Deny(frame, client, {.end = WriteEnd::busy, .reason = kTooMany}, now);
    return replies_->Refuse(frame, kBusy, now.instant);
  }
  exception = write ? Start(request, now.instant)
                    : units_.Read(request, listener_.holes, now.instant, client.number);
  if (exception != kNoException) return replies_->Refuse(frame, exception, now.instant);
  if (!write) replies_->Answer(request, units_.responder(), now.instant);
}

ExceptionCode LocalRequests::Check(View frame) const {
  ModbusRequest request;
  return units_.Check(frame, request);
}

void LocalRequests::Deny(View frame, const std::string& reason, const Now& now) {
  units_.Deny(frame, replies_->client(), {.end = WriteEnd::denied, .reason = reason}, now);
}

ExceptionCode LocalRequests::Start(const ModbusRequest& request, Instant now) {
  const std::uint64_t number = pending_.NextNumber();
  const Instant deadline = now + write_deadline_;
  auto done = [inbox = inbox_, requests = weak_from_this(), number](const WriteResult& result) {
    inbox->Post([requests, number, result](const Now& now) {
      if (const auto self = requests.lock()) self->Finish(number, result, now.instant);
    });
  };
  if (!abandoned_) abandoned_ = std::make_shared<std::atomic<bool>>(false);
  const auto exception =
      units_.Submit(request, {replies_->client(), deadline, abandoned_}, now, std::move(done));
  if (exception != kNoException) return exception;
  PendingRequest pending;
  pending.number = number;
  pending.deadline = deadline;
  pending.frame = CopyOf(request.frame.first(kMbapHeader + kWriteReply));
  replies_->Await(pending.Limit());
  pending_.Add(std::move(pending));
  return kNoException;
}

void LocalRequests::Finish(std::uint64_t number, const WriteResult& result, Instant now) {
  const auto pending = pending_.Take(number);
  if (!pending) return;
  replies_->Settle();
  if (pending->abandoned) return;
  const View asked = pending->frame;
  const ExceptionCode exception = ExceptionOf(result);
  if (exception != kNoException) return replies_->Refuse(asked, exception, now);
  replies_->Answer(AduOf(TransactionOf(asked), UnitOf(asked), PduOf(asked)), now);
}

void LocalRequests::Sweep(const Now& now) {
  for (const std::uint64_t number : pending_.Overdue(now.instant)) {
    Finish(number, {.end = WriteEnd::unknown}, now.instant);
  }
}

void LocalRequests::Abandon() {
  if (abandoned_) std::exchange(abandoned_, nullptr)->store(true);
  pending_.AbandonAll();
}

void LocalRequests::Close() {
  pending_.TakeAll();
  units_.Forget(replies_->client());
}

}  // namespace baudgate::modbus
