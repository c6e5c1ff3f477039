// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_dispatcher.h"

#include <utility>

namespace baudgate {

bool LineDispatcher::Submit(WriteCommand command) {
  const std::uint32_t device = command.device;
  const bool writes = !command.writes().empty();
  bool taken = false;
  const char* not_there = LineSlot::kNotThere;
  const bool there = lines_.OfDevice(device).With([&](LineRunner& runner) {
    not_there = runner.stuck_since() ? "the driver of its line does not answer" : nullptr;
    if (not_there == nullptr) taken = runner.Submit(std::move(command));
  });
  if (there && not_there == nullptr) {
    if (!taken && writes) Count(device, WriteEnd::busy);
    return taken;
  }
  if (writes) Count(device, WriteEnd::not_sent);
  command.End({.end = WriteEnd::not_sent, .reason = not_there});
  return true;
}

void LineDispatcher::OnNotTaken(const DeniedWrite& denied) {
  if (denied.counts && denied.point) Count(denied.device, denied.end);
}

/// Counts a write that does not reach the poller, which counts all others.
void LineDispatcher::Count(std::uint32_t device, WriteEnd end) {
  store_.UpdateStatus(
      device, [end](DeviceStatus& status) { ++status.writes[static_cast<std::size_t>(end)]; });
}

const Protocol* LineDispatcher::FindProtocol(const std::string& name) const {
  return catalog_.FindProtocol(name);
}

void LineDispatcher::Release(std::uint32_t line, Duration time) {
  lines_.at(line).Post([time](LineParts& its, Now now) { its.port.Release(time, now); });
}

void LineDispatcher::Offer(std::uint32_t line, config::PortServer server, Duration time) {
  lines_.at(line).With([&](LineRunner& runner) { runner.Offer(std::move(server), time); });
}

void LineDispatcher::TakeBack(std::uint32_t line) {
  lines_.at(line).With([](LineRunner& runner) { runner.TakeBack(); });
}

void LineDispatcher::SetInUse(std::uint32_t device, bool in_use) {
  lines_.OfDevice(device).Post(
      [device, in_use](LineParts& line, Now now) { line.poller.SetInUse(device, in_use, now); });
}

std::shared_ptr<TraceQueue> LineDispatcher::Trace(std::uint32_t line, std::function<void()> wake) {
  std::shared_ptr<TraceQueue> queue;
  lines_.at(line).With(
      [&](LineRunner& runner) { queue = runner.recorder().Subscribe(std::move(wake)); });
  return queue;
}

std::vector<TraceRecord> LineDispatcher::Recorded(std::uint32_t line) {
  std::vector<TraceRecord> records;
  lines_.at(line).With([&](LineRunner& runner) { records = runner.recorder().Recorded(); });
  return records;
}

}  // namespace baudgate
