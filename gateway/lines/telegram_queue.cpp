// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/telegram_queue.h"

#include <utility>

#include "gateway/base/time.h"

namespace baudgate::lines {
namespace {

WriteEnd EndOf(const bus::WriteCommand& command, Outcome outcome) {
  if (outcome == Outcome::ok) return WriteEnd::ok;
  return bus::EndUnheard(command.state == bus::WriteState::sent);
}

}  // namespace

void TelegramQueue::Answer(bus::WriteCommand& command, WriteEnd end, const std::string& reason,
                           Outcome outcome) {
  command.telegram()->outcome = Name(outcome);
  command.End({.end = end, .reason = reason});
}

void TelegramQueue::Submit(bus::WriteCommand command, const std::optional<std::string>& why_not,
                           Now now) {
  if (why_not) return Answer(command, WriteEnd::not_sent, *why_not, Outcome::line_down);
  command.MoveTo(bus::WriteState::queued);
  waiting_.push_back(std::move(command));
  Settle(now);
}

/// Returns why a waiting telegram can no longer be sent: its client has left, or its deadline has
/// passed, for example because another exchange kept the line busy or the program was suspended.
const char* TelegramQueue::WhyNotSend(const bus::WriteCommand& command, Now now) {
  if (command.client_left()) return bus::kClientLeft;
  return command.deadline <= now.instant ? bus::kTooLate : nullptr;
}

void TelegramQueue::Withdraw(Now now) {
  if (!exchange_ || command_->state == bus::WriteState::sent) return;
  const char* const why = WhyNotSend(*command_, now);
  if (why == nullptr) return;
  exchange_.reset();
  bus::WriteCommand withdrawn = std::move(*std::exchange(command_, std::nullopt));
  Answer(withdrawn, WriteEnd::not_sent, why, Outcome::busy);
}

void TelegramQueue::Settle(Now now) {
  Withdraw(now);
  while (!waiting_.empty()) {
    const char* const why = WhyNotSend(waiting_.front(), now);
    if (why == nullptr) break;
    bus::WriteCommand withdrawn = std::move(waiting_.front());
    waiting_.pop_front();
    Answer(withdrawn, WriteEnd::not_sent, why, Outcome::busy);
  }
  if (exchange_) return;
  if (waiting_.empty()) {
    poller_.GoOn(now);
    return;
  }
  if (!poller_.Pause(now)) return;
  command_ = std::move(waiting_.front());
  waiting_.pop_front();
  const bus::Speaking as = poller_.SpeakingAs(command_->device);
  serial_ = as.serial;
  exchange_.emplace(as, line_.echo, command_->telegram()->bytes, now.instant);
  Hand(exchange_->Begin(now.instant), now);
}

void TelegramQueue::Hand(bool send, Now now) {
  if (send) {
    command_->MoveTo(bus::WriteState::sent);
    tap_.OnSent(command_->device, exchange_->request(), now);
    port_.Send(exchange_->request().bytes, serial_, now);
  }
  if (exchange_->has_ended() && !ProvesLife(exchange_->end().outcome)) {
    TakeBack();
    port_.DropUnsent();
  }
  if (exchange_->is_over()) End(now);
}

/// Sets a failed telegram that was never put on the wire to `queued` again, because no device can
/// have received it.
void TelegramQueue::TakeBack() {
  const bool sent = command_->state == bus::WriteState::sent;
  if (sent && port_.IsUnsent()) command_->MoveTo(bus::WriteState::queued);
}

bool TelegramQueue::TakeBytes(View bytes, Now now) {
  if (!exchange_) return false;
  tap_.OnReceived(bytes, now);
  Hand(exchange_->Receive(bytes, now.instant), now);
  return true;
}

void TelegramQueue::OnTimer(Now now) {
  Withdraw(now);
  if (exchange_) Hand(exchange_->OnTimer(now.instant), now);
  Settle(now);
}

void TelegramQueue::End(Now now) {
  const bus::ExchangeEnd end = exchange_->end();
  tap_.OnExchangeEnd(command_->device, end, now);
  command_->telegram()->reply = exchange_->reply();
  exchange_.reset();
  bus::WriteCommand done = std::move(*std::exchange(command_, std::nullopt));
  const bool unsent = done.state == bus::WriteState::queued;
  if (!unsent && !done.telegram()->reads) {
    poller_.OnWritingTelegram(done.device, done.telegram()->bytes, now);
  }
  if (!unsent && !ProvesLife(end.outcome)) poller_.OnUnansweredTelegram(now);
  Answer(done, EndOf(done, end.outcome), unsent ? bus::kNotConnected : end.reason, end.outcome);
  Settle(now);
}

void TelegramQueue::OnClosed(const std::string& reason) {
  if (exchange_) {
    TakeBack();
    exchange_.reset();
    bus::WriteCommand cut = std::move(*std::exchange(command_, std::nullopt));
    Answer(cut, EndOf(cut, Outcome::line_down), reason, Outcome::line_down);
  }
  for (bus::WriteCommand& command : std::exchange(waiting_, {})) {
    Answer(command, WriteEnd::not_sent, reason, Outcome::line_down);
  }
}

std::optional<Instant> TelegramQueue::Deadline() const {
  std::optional<Instant> under_way;
  std::optional<Instant> unsent;
  std::optional<Instant> waiting;
  if (exchange_) under_way = exchange_->Deadline();
  if (command_ && command_->state != bus::WriteState::sent) unsent = command_->deadline;
  if (!waiting_.empty()) waiting = waiting_.front().deadline;
  return Soonest({under_way, unsent, waiting});
}

}  // namespace baudgate::lines
