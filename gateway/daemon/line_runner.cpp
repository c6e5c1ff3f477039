// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/line_runner.h"

namespace baudgate {

LineRunner::LineRunner(asio::io_context& loop, const config::Line& line, std::uint32_t first_device,
                       const Poller::FindProtocol& find, PointStore& store,
                       LineRecorder::Sink recordings, DeviceMemory* memory, EventSink* events)
    : io_(loop),
      timer_(loop),
      keeper_(loop, line.port, [this] { transport_->Open(); }),
      transport_(MakeTransport(line, loop, *this)),
      driver_(line, first_device, find, store, *transport_, keeper_, std::move(recordings), memory,
              events) {}

void LineRunner::Start() {
  started_ = true;
  Post([this](Now now) { driver_.Start(now); });
}

void LineRunner::RequestStop() {
  if (!started_ || std::exchange(stopping_, true)) return;
  Post([this](Now now) {
    driver_.Stop(now, [this] {
      timer_.cancel();
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

void LineRunner::OnUnsettledWrite(std::uint32_t device) {
  Post([this, device](Now) { driver_.OnUnsettledWrite(device); });
}

void LineRunner::OnHostClock(bool right) {
  Post([this, right](Now) { driver_.OnHostClock(right); });
}

void LineRunner::Release(Duration time) {
  Post([this, time](Now now) { driver_.Release(time, now); });
}

void LineRunner::TakeBack() {
  Post([this](Now now) { driver_.TakeBack(now); });
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
