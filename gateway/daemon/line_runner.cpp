// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/line_runner.h"

namespace baudgate {

LineRunner::LineRunner(asio::io_context& loop, const config::Line& line, std::uint32_t first_device,
                       const Poller::FindProtocol& find, PointStore& store,
                       LineRecorder::Sink recordings, DeviceMemory* memory, EventSink* events,
                       const LoanRecords& loans)
    : io_(loop),
      timer_(loop),
      keeper_(loop, line.port, [this] { transport_->Open(); }),
      transport_(MakeTransport(line, loop, *this)),
      driver_(line, first_device, find, store, *transport_, keeper_, std::move(recordings), memory,
              events, loans),
      config_(line),
      offer_end_(loop) {}

void LineRunner::Start() {
  started_ = true;
  Post([this](Now now) {
    Serve();
    driver_.Start(now);
  });
}

void LineRunner::RequestStop() {
  if (!started_ || std::exchange(stopping_, true)) return;
  Post([this](Now now) {
    driver_.Stop(now, [this] {
      timer_.cancel();
      offer_end_.cancel();
      server_.reset();
      offered_.reset();
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
  if (stuck_since()) return false;
  const auto ticket = queued_.Take(command.client, command.dropped);
  if (!ticket) return false;
  command.done = [this, ticket = *ticket,
                  done = std::move(command.done)](const WriteResult& result) {
    queued_.Give(ticket);
    done(result);
  };
  Post([this, command = std::move(command)](Now now) mutable {
    driver_.Submit(std::move(command), now);
  });
  return true;
}

bool LineRunner::Submit(RoutedRequest request) {
  if (stuck_since()) return false;
  if (routed_.fetch_add(1) >= RouteQueue::LimitFor(request)) {
    --routed_;
    return false;
  }
  request.done = [this, done = std::move(request.done)](RoutedReply reply) {
    --routed_;
    done(std::move(reply));
  };
  Post([this, request = std::move(request)](Now now) mutable {
    driver_.Submit(std::move(request), now);
  });
  return true;
}

void LineRunner::Forget(std::uint64_t client) {
  Post([this, client](Now now) { driver_.Forget(client, now); });
}

void LineRunner::SetInUse(std::uint32_t device, bool in_use) {
  Post([this, device, in_use](Now now) { driver_.SetInUse(device, in_use, now); });
}

void LineRunner::OnEventsKept(std::uint32_t device, std::string said, bool reported) {
  Post([this, device, said = std::move(said), reported](Now now) {
    driver_.OnEventsKept(device, said, reported, now);
  });
}

void LineRunner::OnHostClock(bool right) {
  Post([this, right](Now) { driver_.OnHostClock(right); });
}

void LineRunner::Release(Duration time) {
  Post([this, time](Now now) { driver_.Release(time, now); });
}

void LineRunner::TakeBack() {
  Post([this](Now now) {
    Withdraw(now);
    driver_.TakeBack(now);
  });
}

// ---------------------------------------------------------------- clients of its port

void LineRunner::Serve() {
  const config::PortServer* const server = config_.server();
  if (server == nullptr) return;
  using serial_server::Server;
  const auto use = config_.serial_server ? Server::Use::served : Server::Use::lent;
  driver_.loan().Offer(*server, WallTime::max());
  server_ = std::make_unique<Server>(io_, *server, use, config_.name, *this);
  server_->Start();
}

void LineRunner::Offer(config::PortServer server, Duration time) {
  Post([this, server = std::move(server), time](Now now) {
    Withdraw(now);
    using serial_server::Server;
    offer_ = server;
    driver_.loan().Offer(offer_, now.wall + time);
    offered_ = std::make_unique<Server>(io_, offer_, Server::Use::lent, config_.name, *this);
    offered_->Start();
    offer_end_.expires_at(now.instant + time);
    offer_end_.async_wait([this](const asio::error_code& error) {
      if (error) return;
      Withdraw(ReadClocks());
      Arm();
    });
  });
}

void LineRunner::Withdraw(Now now) {
  if (!offered_) return;
  offer_end_.cancel();
  driver_.Dismiss(*offered_, "the time of the loan is over", now);
  offered_.reset();
  driver_.loan().Offer(offer_, WallTime{});
}

void LineRunner::Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now) {
  driver_.Want(user, visit, now);
  Arm();
}

void LineRunner::Return(serial_server::PortUser& user, const serial_server::Visit& visit,
                        const std::string& why, Now now) {
  driver_.Return(user, visit, why, now);
  Arm();
}

void LineRunner::OnListening(const std::string& place, const std::string& trouble, Now now) {
  driver_.loan().OnListening(place, trouble, now);
}

void LineRunner::OnOpened() {
  driver_.OnOpened(ReadClocks());
  Arm();
}

void LineRunner::OnOpenFailed(const std::string& reason) {
  driver_.OnOpenFailed(reason, ReadClocks());
  Arm();
}

void LineRunner::OnBytes(View bytes) {
  driver_.OnBytes(bytes, ReadClocks());
  Arm();
}

void LineRunner::OnLost(const std::string& reason) {
  driver_.OnLost(reason, ReadClocks());
  Arm();
}

void LineRunner::OnEnded(const std::string& reason) {
  driver_.OnEnded(reason, ReadClocks());
  Arm();
}

/// A timer that ends early once costs less than one that is set anew at every input.
void LineRunner::Arm() {
  const auto deadline = driver_.Deadline();
  if (!deadline || *deadline >= armed_) return;
  armed_ = *deadline;
  timer_.expires_at(armed_);
  timer_.async_wait([this](const asio::error_code& error) {
    if (error) return;
    armed_ = Instant::max();
    driver_.OnTimer(ReadClocks());
    Arm();
  });
}

}  // namespace baudgate
