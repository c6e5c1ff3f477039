// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <asio/post.hpp>
#include <future>
#include <system_error>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate::lines {

ThreadKind ThreadKindOf(std::string_view port) {
  const bool never_blocks = config::IsNetworkPort(port) || port.starts_with("/dev/pts/");
  return never_blocks ? ThreadKind::shared_loop : ThreadKind::own_thread;
}

std::size_t SharedLoops(const std::vector<config::Line>& lines, std::size_t cores) {
  constexpr std::size_t kMost = 4;
  const auto sharing =
      static_cast<std::size_t>(std::ranges::count_if(lines, [](const config::Line& line) {
        return ThreadKindOf(line.port) == ThreadKind::shared_loop;
      }));
  return std::clamp<std::size_t>(std::min(cores, sharing), 1, kMost);
}

void LoopWatch::Add(std::string name, std::optional<std::uint32_t> line, Ask ask) {
  loops_.push_back(
      {std::move(name), line, std::move(ask), std::make_shared<std::atomic<bool>>(true)});
}

void LoopWatch::Remove(std::uint32_t line) {
  std::erase_if(loops_, [line](const Loop& loop) { return loop.line == line; });
}

std::vector<LoopWatch::Change> LoopWatch::Look(WallTime now) {
  std::vector<Change> changes;
  complete_ = true;
  for (Loop& loop : loops_) {
    if (loop.answered->exchange(false)) {
      if (loop.missed >= kStuckAfter) changes.push_back({loop.name, loop.line, {}});
      loop.missed = 0;
      loop.asked = now;
      loop.ask([answered = loop.answered] { answered->store(true); });
      continue;
    }
    if (++loop.missed == kStuckAfter) changes.push_back({loop.name, loop.line, loop.asked});
    if (!loop.line) complete_ = false;
  }
  return changes;
}

namespace {

LoopWatch::Ask AskOn(asio::io_context& io) {
  return [&io](std::function<void()> sign) { asio::post(io, std::move(sign)); };
}

}  // namespace

Lines::Lines(bus::PointStore& store, const config::Catalog& catalog, std::size_t loops)
    : store_(store), find_([&catalog](const std::string& name) -> const protocols::Protocol& {
        static constexpr protocols::Protocol kNone;  // for a line that only clients of its port use
        return name.empty() ? kNone : *catalog.FindProtocol(name);
      }) {
  while (shared_.size() < loops) {
    const std::string name = fmt::format("lines {}", shared_.size() + 1);
    shared_.push_back(std::make_unique<transports::LoopThread>(name));
    Watch(name, shared_.back()->io());
  }
}

Lines::~Lines() {
  End();
  StopLoops();
}

Result<std::shared_ptr<transports::LoopThread>> Lines::MakeLoop(const config::Line& line) try {
  if (ThreadKindOf(line.port) == ThreadKind::shared_loop)
    return std::shared_ptr<transports::LoopThread>();
  auto loop = std::make_shared<transports::LoopThread>("line " + line.name);
  loop->Start();
  return loop;
} catch (const std::system_error& failed) {
  return Error{"line " + line.name +
               ": no thread could be started for its port: " + failed.code().message()};
}

asio::io_context& Lines::LoopFor(LineEntry& entry) {
  if (!entry.own) return shared_[turn_++ % shared_.size()]->io();
  const MutexLock lock(watch_mutex_);
  watch_.Add("line " + entry.config->name, static_cast<std::uint32_t>(entries_.size() - 1),
             AskOn(entry.own->io()));
  return entry.own->io();
}

void Lines::Add(std::shared_ptr<const config::Line> line,
                std::shared_ptr<transports::LoopThread> own) {
  const auto number = static_cast<std::uint32_t>(entries_.size());
  const auto first_device = static_cast<std::uint32_t>(line_of_.size());
  LineEntry& entry = entries_.Append(std::move(line));
  entry.own = std::move(own);
  for (std::size_t i = 0; i < entry.config->devices.size(); ++i) line_of_.Append(number);
  entry.slot.Put(std::make_unique<LineRunner>(LoopFor(entry), entry.config, first_device, find_,
                                              store_, links_));
}

void Lines::Start() {
  if (!std::exchange(running_, true)) {
    for (const auto& loop : shared_) loop->Start();
  }
  const MutexLock lock(clock_mutex_);
  const std::optional<bool> right = clock_right_;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    LineEntry& entry = entries_[i];
    if (std::exchange(entry.started, true)) continue;
    entry.slot.With([](LineRunner& runner) { runner.Start(); });
    if (right) entry.slot.Post([right](LineParts& line, Now) { line.poller.OnHostClock(*right); });
  }
}

std::vector<std::string> Lines::NotOpen(std::span<const std::uint32_t> lines) const {
  std::vector<std::future<void>> tried;
  for (const std::uint32_t line : lines) {
    auto done = std::make_shared<std::promise<void>>();
    tried.push_back(done->get_future());
    // LineRunner::Start posts the first try to open the port. The second post is behind this try.
    const LineSlot& slot = at(line);
    slot.Post([&slot, done](LineParts&, Now) {
      slot.Post([done](LineParts&, Now) { done->set_value(); });
    });
  }
  const Instant deadline = ReadClocks().instant + kWaitForPorts;
  for (const auto& one : tried) one.wait_until(deadline);
  std::vector<std::string> troubles;
  for (const std::uint32_t line : lines) {
    const config::Line& its = *entries_[line].config;
    const std::string name = "line " + its.name + ": ";
    const bus::LineStatus status = store_.ReadLine(line);
    const bool tried_in_vain = !its.is_network() && status.port == bus::LineStatus::Port::closed &&
                               !status.port_text.empty() && status.port_text != kNotOpenedYet;
    if (tried_in_vain) {
      troubles.push_back(name + status.port_text);
    }
    for (const bus::PortService& service : status.services) {
      if (service.trouble.empty()) continue;
      troubles.push_back(name + "no client can connect at " + service.place + ": " +
                         service.trouble);
    }
  }
  return troubles;
}

void Lines::Remove(std::span<const std::uint32_t> lines) {
  struct Ending {
    std::uint32_t line = 0;
    std::unique_ptr<LineRunner> runner;
  };
  std::vector<Ending> ending;
  for (const std::uint32_t line : lines) {
    auto runner = entries_[line].slot.Take();
    if (runner) ending.push_back({line, std::move(runner)});
  }
  for (const Ending& one : ending) {
    one.runner->RequestStop("a reload has changed or removed the line");
  }
  const Instant deadline = ReadClocks().instant + kWaitForLines;
  for (Ending& one : ending) {
    LineEntry& entry = entries_[one.line];
    std::shared_ptr<const config::Line> config;
    {
      const MutexLock lock(watch_mutex_);
      watch_.Remove(one.line);
      config.swap(entry.config);
    }
    if (!one.runner->StopBefore(deadline)) {
      one.runner->Retire();
      log::Warn({.line = config->name},
                "the driver of the port does not return from a call, so the line cannot be stopped "
                "and is abandoned. Check its adapter (dmesg)");
      hanging_.push_back(std::move(one.runner));
      continue;
    }
    one.runner.reset();
    if (entry.own) entry.own->Stop();
    entry.own.reset();
  }
}

// Stop and End below wait until lines have ended. Meanwhile they hold no lock of a LineSlot,
// because a thread that a line needs for its end may wait for this lock.

std::vector<LineRunner*> Lines::All() const {
  std::vector<LineRunner*> all;
  for (std::size_t i = 0; i < entries_.size(); ++i) all.push_back(entries_[i].slot.mine());
  for (const auto& runner : hanging_) all.push_back(runner.get());
  std::erase(all, nullptr);
  return all;
}

std::vector<std::string> Lines::Stop() {
  for (LineRunner* const runner : All()) runner->RequestStop();
  const Instant deadline = ReadClocks().instant + kWaitForLines;
  std::vector<std::string> hang;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    LineRunner* const runner = entries_[i].slot.mine();
    if (runner != nullptr && !runner->StopBefore(deadline))
      hang.push_back(entries_[i].config->name);
  }
  for (const auto& runner : hanging_) {
    if (!runner->StopBefore(deadline))
      hang.emplace_back("a line that an earlier reload has removed");
  }
  return hang;
}

void Lines::End() {
  for (LineRunner* const runner : All()) runner->Stop();
}

void Lines::StopLoops() {
  for (const auto& loop : shared_) loop->Stop();
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].own) entries_[i].own->Stop();
  }
}

std::size_t Lines::present() const {
  std::size_t present = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    present += entries_[i].slot.With([](LineRunner&) {}) ? 1 : 0;
  }
  return present;
}

std::size_t Lines::open() const {
  std::size_t open = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    entries_[i].slot.With([&](LineRunner& runner) { open += runner.is_open() ? 1 : 0; });
  }
  return open;
}

std::optional<WallTime> Lines::stuck_since(std::uint32_t line) const {
  std::optional<WallTime> since;
  at(line).With([&](LineRunner& runner) { since = runner.stuck_since(); });
  return since;
}

void Lines::OnHostClock(bool right) {
  const MutexLock lock(clock_mutex_);
  clock_right_ = right;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    entries_[i].slot.Post([right](LineParts& line, Now) { line.poller.OnHostClock(right); });
  }
}

void Lines::Watch(const std::string& name, asio::io_context& io) {
  const MutexLock lock(watch_mutex_);
  watch_.Add(name, {}, AskOn(io));
}

bool Lines::Look(WallTime now) {
  const MutexLock lock(watch_mutex_);
  for (const LoopWatch::Change& change : watch_.Look(now)) OnLoop(change);
  return watch_.complete();
}

void Lines::OnLoop(const LoopWatch::Change& change) {
  const bool stuck = change.stuck_since.has_value();
  if (!change.line) {
    if (!stuck) return log::Info("{}: its thread runs again", change.loop);
    return log::Fail(
        "{}: its thread hangs. If the thread does not run again, systemd's watchdog restarts the "
        "gateway",
        change.loop);
  }
  at(*change.line).With([&](LineRunner& runner) { runner.SetStuck(change.stuck_since); });
  const config::Line& line = *entries_[*change.line].config;
  const log::About about{.line = line.name};
  if (!stuck) return log::Info(about, "its thread runs again");
  log::Warn(about,
            "its thread hangs: a call of the driver of {} does not return. Other lines are not "
            "affected; check the adapter (dmesg)",
            line.port);
}

bool LineDispatcher::Submit(bus::WriteCommand command) {
  const std::uint32_t device = command.device;
  const bool writes = !command.writes().empty();
  bool taken = false;
  const char* not_there = LineSlot::kNotThere;
  const bool there = lines_.OfDevice(device).With([&](LineRunner& runner) {
    not_there = runner.stuck_since()
                    ? "the driver of its line's port does not answer; check the adapter (dmesg)"
                    : nullptr;
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

void LineDispatcher::OnNotTaken(const bus::DeniedWrite& denied) {
  if (denied.counts && denied.point) Count(denied.device, denied.end);
}

/// Counts a write that does not reach the poller. The poller counts all other writes.
void LineDispatcher::Count(std::uint32_t device, WriteEnd end) {
  store_.UpdateStatus(device, [end](bus::DeviceStatus& status) {
    ++status.writes.ends[static_cast<std::size_t>(end)];
  });
}

const protocols::Protocol* LineDispatcher::FindProtocol(const std::string& name) const {
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

void LineDispatcher::SetInUse(std::uint32_t device, bool in_use, const std::string& by) {
  lines_.OfDevice(device).Post([device, in_use, by](LineParts& line, Now now) {
    line.poller.SetInUse(device, in_use, now, by);
  });
}

std::shared_ptr<records::TraceQueue> LineDispatcher::Trace(std::uint32_t line,
                                                           std::function<void()> wake) {
  std::shared_ptr<records::TraceQueue> queue;
  lines_.at(line).With(
      [&](LineRunner& runner) { queue = runner.recorder().Subscribe(std::move(wake)); });
  return queue;
}

std::vector<records::TraceRecord> LineDispatcher::Recorded(std::uint32_t line) {
  std::vector<records::TraceRecord> records;
  lines_.at(line).With([&](LineRunner& runner) { records = runner.recorder().Recorded(); });
  return records;
}

ManualSettings ManualSettingsOf(const bus::PointStore& store, std::uint32_t line,
                                const config::Line& config) {
  ManualSettings settings;
  const bus::LineStatus status = store.ReadLine(line);
  // A loan to a network client is not restored, because the client loses its connection.
  const bool by_hand = status.port == bus::LineStatus::Port::released && !status.lent_to_client;
  settings.released_until = by_hand ? status.released_until : status.release_asked_until;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    if (store.gone(device)) continue;
    store.Read(device, [&](const bus::DeviceRecord& record) {
      const config::Device& its = *record.device;
      const bool in_use = record.status.state != bus::DeviceState::disabled;
      if (record.line->name != config.name || in_use == its.enabled) return;
      settings.in_use.emplace(its.name, in_use);
    });
  }
  return settings;
}

void Restore(const ManualSettings& before, LineControl& lines, const config::Line& config,
             std::uint32_t line, std::uint32_t first_device, WallTime now) {
  if (before.released_until > now) {
    lines.Release(line, std::chrono::ceil<std::chrono::seconds>(before.released_until - now));
  }
  const std::vector<config::Device>& devices = config.devices;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const auto set = before.in_use.find(devices[i].name);
    if (set == before.in_use.end() || set->second == devices[i].enabled) continue;
    lines.SetInUse(first_device + static_cast<std::uint32_t>(i), set->second);
  }
}

}  // namespace baudgate::lines
