// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_runner.h"

#include <algorithm>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/diagnosis/observer.h"
#include "protocols/protocol.h"

namespace baudgate::lines {
namespace {

Duration ReplyTime(const config::Line& line, const bus::Poller::FindProtocol& find) {
  return *config::Resolve(line.timing, find(line.protocol).timing(line.serial)).reply;
}

bool Listens(const config::Line& line, const bus::Poller::FindProtocol& find) {
  return std::ranges::any_of(line.devices, [&](const config::Device& device) {
    return SpeaksUnasked(find(device.protocol), device.options);
  });
}

}  // namespace

LineParts::LineParts(const config::Line& line, std::uint32_t first_device,
                     const bus::Poller::FindProtocol& find, bus::PointStore& store,
                     transports::Transport& transport, transports::PortRetries& retries,
                     Links links)
    : line_(line),
      first_device_(first_device),
      memory_(links.memory),
      recorder(line, first_device, std::move(links.recordings)),
      reporter(line, store, recorder, links.memory, links.events),
      poller(line, first_device, find, store, port, reporter, &diagnosis::Observe),
      telegrams(line, poller, recorder, port),
      port(line, store, transport, retries, recorder, reporter, poller, telegrams, loan,
           Listens(line, find), TransactionBytes(find(line.protocol))),
      loan({line, store, transport, reporter, links.loans, ReplyTime(line, find)}, port) {
  poller.Attach(recorder, std::move(links.foreign));
}

void LineParts::Start(Now now) {
  for (std::size_t i = 0; memory_ != nullptr && i < line_.devices.size(); ++i) {
    const auto device = first_device_ + static_cast<std::uint32_t>(i);
    poller.Recall(device, memory_->Of(device), now);
  }
  port.Start(now);
}

void LineParts::Submit(bus::WriteCommand command, Now now) {
  if (command.telegram()) {
    std::optional<std::string> why_not;
    if (!port.is_open()) {
      why_not = loan.InUse().value_or(
          "the port of the line is not open, or is lent; see 'baudgate status'");
    }
    telegrams.Submit(std::move(command), why_not, now);
  } else {
    poller.Submit(std::move(command), now);
  }
}

void LineParts::OnEventsKept(std::uint32_t device, const std::string& said, bool reported,
                             Now now) {
  if (reporter.TakeKept(device, reported)) poller.OnEventsKept(device, said, now);
}

void LineParts::OnTimer(Now now) {
  port.OnTimer(now);
  if (HasCome(loan.Deadline(), now.instant)) loan.OnTimer(now);
  if (HasCome(telegrams.Deadline(), now.instant)) telegrams.OnTimer(now);
  if (HasCome(poller.Deadline(), now.instant)) poller.OnTimer(now);
}

void LineParts::Settle(Now now) {
  port.Settle(now);
  if (!loan.Settle(now)) telegrams.Settle(now);
}

std::optional<Instant> LineParts::Deadline() const {
  return Soonest({poller.Deadline(), port.Deadline(), loan.Deadline(), telegrams.Deadline()});
}

using serial_server::Server;

std::unique_ptr<Server> LineServers::Make(const config::PortServer& server, Server::Use use) {
  auto made = std::make_unique<Server>(io_, server, use, line_.name, owner_);
  made->Start();
  return made;
}

void LineServers::Start() {
  const config::PortServer* const server = line_.server();
  if (server == nullptr) return;
  loan_.Serve(*server);
  server_ = Make(*server, line_.serial_server ? Server::Use::served : Server::Use::lent);
}

void LineServers::Stop(const std::string& why) {
  server_.reset();
  Close(why);
}

void LineServers::Offer(config::PortServer server, Duration time, Now now) {
  Withdraw("a new 'baudgate release' replaces this loan", now);
  offer_ = std::move(server);
  loan_.Offer(offer_, time, now);
  offered_ = Make(offer_, Server::Use::by_hand);
}

void LineServers::Withdraw(const std::string& why, Now now) {
  if (!offered_) return;
  loan_.TakeBackFrom(*offered_, why, now);
  Close(why);
  loan_.Withdraw(offer_);
}

void LineServers::Close(const std::string& why) {
  if (!offered_) return;
  offered_.reset();
  log::Info({.line = line_.name}, "clients can no longer connect at {}: {}", offer_.Address(), why);
}

LineRunner::LineRunner(asio::io_context& loop, std::shared_ptr<const config::Line> line,
                       std::uint32_t first_device, const bus::Poller::FindProtocol& find,
                       bus::PointStore& store, LineParts::Links links)
    : io_(loop),
      config_(std::move(line)),
      timer_(loop),
      keeper_(loop, config_->port, [this] { transport_->Open(); }),
      transport_(transports::MakeTransport(*config_, loop, *this)),
      line_(*config_, first_device, find, store, *transport_, keeper_, std::move(links)),
      servers_(loop, *config_, *this, line_.loan),
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
      // Handlers that are ready, or that the cancellations above make ready, run before the second
      // post. So no handler of the line runs after Stop has returned.
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

bool LineRunner::Submit(bus::WriteCommand command) {
  const auto ticket = queued_.Take(command.client, command.abandoned);
  if (!ticket) return false;
  command.observers.push_back(
      [this, ticket = *ticket](const bus::WriteCommand&, const WriteResult&) {
        queued_.Give(ticket);
      });
  Post([command = std::move(command)](LineParts& line, Now now) mutable {
    line.Submit(std::move(command), now);
  });
  return true;
}

bool LineRunner::Submit(bus::RoutedRequest request) {
  if (stuck_since()) {
    request.done({Outcome::line_down,
                  {},
                  "the driver of the line's port does not answer; check the adapter (dmesg)"});
    return true;
  }
  if (!bus::RouteQueue::TakePlace(routed_, request)) return false;
  request.done = [this, host = request.host,
                  done = std::move(request.done)](bus::RoutedReply reply) {
    routed_.Give(host);
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
  OnNoConnection(reason, transports::NoConnection::other);
}

void LineRunner::OnNoConnection(const std::string& reason, transports::NoConnection why) {
  Handle([&](LineParts& line, Now now) { line.port.OnOpenFailed(reason, why, now); });
}

void LineRunner::OnBytes(View bytes) {
  Handle([&](LineParts& line, Now now) { line.port.PassOn(bytes, now); });
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

/// Moves the timer only to an earlier deadline, because a timer that ends too early costs less than
/// setting it at every input.
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

}  // namespace baudgate::lines
