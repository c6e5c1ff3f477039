// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_parts.h"

#include <algorithm>
#include <utility>

#include "gateway/base/deadline.h"
#include "gateway/diagnosis/observer.h"
#include "protocols/transaction.h"

namespace baudgate {

namespace {

Duration ReplyTime(const config::Line& line, const Poller::FindProtocol& find) {
  return *config::Resolve(line.timing, find(line.protocol).timing(line.serial)).reply;
}

bool Listens(const config::Line& line, const Poller::FindProtocol& find) {
  return std::ranges::any_of(line.devices, [&](const config::Device& device) {
    return SpeaksUnasked(find(device.protocol), device.options);
  });
}

}  // namespace

LineParts::LineParts(const config::Line& line, std::uint32_t first_device,
                     const Poller::FindProtocol& find, PointStore& store, Transport& transport,
                     PortRetries& retries, Links links)
    : line_(line),
      first_device_(first_device),
      memory_(links.memory),
      recorder(line, first_device, std::move(links.recordings)),
      reporter(line, store, recorder, links.memory, links.events),
      poller(line, first_device, find, store, port, reporter, &Observe),
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

void LineParts::Submit(WriteCommand command, Now now) {
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

}  // namespace baudgate
