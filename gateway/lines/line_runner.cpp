// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_runner.h"

namespace baudgate {

LineRunner::LineRunner(asio::io_context& loop, const config::Line& line, std::uint32_t first_device,
                       const Poller::FindProtocol& find, PointStore& store, LineParts::Links links)
    : io_(loop),
      timer_(loop),
      keeper_(loop, line.port, [this] { transport_->Open(); }),
      transport_(MakeTransport(line, loop, *this)),
      line_(line, first_device, find, store, *transport_, keeper_, std::move(links)),
      servers_(loop, line, *this, line_.loan),
      offer_end_(loop) {}

void LineRunner::Start() {
  started_ = true;
  Post([this](LineParts& line, Now now) {
    servers_.Start();
    line.Start(now);
  });
}

void LineRunner::RequestStop(const std::string& why) {
  if (!started_ || std::exchange(stopping_, true)) return;
  Post([this, why](LineParts& line, Now now) {
    line.port.Stop(why, now, [this, why] {
      timer_.cancel();
      offer_end_.cancel();
      servers_.Stop(why);
      // What was ready before, or is cancelled by this, stands before these two in the loop's
      // queue.
      asio::post(io_, [this] { asio::post(io_, [stopped = stopped_] { stopped->set_value(); }); });
    });
  });
}

void LineRunner::Stop() {
  RequestStop();
  if (std::exchange(started_, false)) ended_.wait();
}

bool LineRunner::StopBefore(Instant deadline) {
  RequestStop();
  if (!started_) return true;
  if (ended_.wait_until(deadline) != std::future_status::ready) return false;
  started_ = false;
  return true;
}

bool LineRunner::Submit(WriteCommand command) {
  const auto ticket = queued_.Take(command.client, command.abandoned);
  if (!ticket) return false;
  command.observers.push_back(
      [this, ticket = *ticket](const WriteResult&) { queued_.Give(ticket); });
  Post([command = std::move(command)](LineParts& line, Now now) mutable {
    line.Submit(std::move(command), now);
  });
  return true;
}

bool LineRunner::Submit(RoutedRequest request) {
  if (stuck_since()) {
    request.done({Outcome::line_down, {}, "the driver of the line does not answer"});
    return true;
  }
  if (routed_.fetch_add(1) >= RouteQueue::LimitFor(request)) {
    --routed_;
    return false;
  }
  request.done = [this, done = std::move(request.done)](RoutedReply reply) {
    --routed_;
    done(std::move(reply));
  };
  Post([request = std::move(request)](LineParts& line, Now now) mutable {
    line.poller.Submit(std::move(request), now);
  });
  return true;
}

void LineRunner::Offer(config::PortServer server, Duration time) {
  Post([this, server = std::move(server), time](LineParts&, Now now) mutable {
    servers_.Offer(std::move(server), time, now);
    offer_end_.expires_at(now.instant + time);
    offer_end_.async_wait([this](const asio::error_code& error) {
      if (error) return;
      Handle([this](LineParts&, Now at) { servers_.Withdraw("the time of the loan is over", at); });
    });
  });
}

void LineRunner::TakeBack() {
  Post([this](LineParts& line, Now now) {
    offer_end_.cancel();
    servers_.Withdraw(std::string(kTakenBack), now);
    line.port.EndRelease(now);
  });
}

void LineRunner::Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now) {
  Handle([&](LineParts& line, Now now) { line.loan.Want(user, visit, now); });
}

void LineRunner::Return(serial_server::PortUser& user, const serial_server::Visit& visit,
                        const std::string& why, Now) {
  Handle([&](LineParts& line, Now now) { line.loan.Return(user, visit, why, now); });
}

void LineRunner::OnListening(const std::string& place, const std::string& trouble, Now now) {
  line_.loan.OnListening(place, trouble, now);
}

void LineRunner::OnOpened() {
  Handle([](LineParts& line, Now now) { line.port.OnOpened(now); });
}

void LineRunner::OnOpenFailed(const std::string& reason) {
  OnNoConnection(reason, NoConnection::other);
}

void LineRunner::OnNoConnection(const std::string& reason, NoConnection why) {
  Handle([&](LineParts& line, Now now) { line.port.OnOpenFailed(reason, why, now); });
}

void LineRunner::OnBytes(View bytes) {
  Handle([&](LineParts& line, Now now) { line.port.OnBytes(bytes, now); });
}

void LineRunner::OnLost(const std::string& reason) {
  Handle([&](LineParts& line, Now now) { line.port.OnLost(reason, now); });
}

void LineRunner::OnStuck(const std::string& reason) {
  Handle([&](LineParts& line, Now now) { line.port.OnLost(reason, now, true); });
}

void LineRunner::OnEnded(const std::string& reason, bool unread) {
  Handle([&](LineParts& line, Now now) { line.port.OnEnded(reason, unread, now); });
}

/// A timer that ends early once costs less than one that is set again at every input.
void LineRunner::Arm() {
  const auto deadline = line_.Deadline();
  if (!deadline || *deadline >= armed_) return;
  armed_ = *deadline;
  timer_.expires_at(armed_);
  timer_.async_wait([this](const asio::error_code& error) {
    if (error) return;
    armed_ = Instant::max();
    Handle([](LineParts& line, Now now) { line.OnTimer(now); });
  });
}

}  // namespace baudgate
