// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/base/log.h"
#include "gateway/base/shown.h"
#include "gateway/base/version.h"
#include "gateway/control/control_server.h"
#include "gateway/daemon/age_timer.h"
#include "gateway/daemon/descriptors.h"
#include "gateway/daemon/event_path.h"
#include "gateway/daemon/history_path.h"
#include "gateway/daemon/host_clock.h"
#include "gateway/daemon/line_runner.h"
#include "gateway/daemon/loop_watch.h"
#include "gateway/daemon/placement.h"
#include "gateway/daemon/write_path.h"
#include "gateway/modbus/server/modbus_server.h"
#include "gateway/state/device_memory.h"
#include "gateway/state/state_folder.h"
#include "gateway/trace/recordings.h"
#include "transports/loop_thread.h"
#ifdef BAUDGATE_WITH_DDS
#include "gateway/daemon/dds_output.h"
#endif

namespace baudgate {
namespace {

/// glibc gives every thread an arena of its own; with a thread per line that is memory for nothing.
constexpr int kMostArenas = 2;
/// For all lines together to end: a second for a write under way (line_driver.cpp), and some room.
constexpr Duration kPatienceWithLines = 1300ms;

LoopWatch::Ask AskOn(asio::io_context& io) {
  return [&io](std::function<void()> sign) { asio::post(io, std::move(sign)); };
}

modbus::ModbusLimits LimitsOf(const config::Config& config) {
  const modbus::DescriptorNeeds needs = modbus::DescriptorNeedsOf(config);
  const std::size_t limit = modbus::RaiseDescriptorLimit(needs.all());
  modbus::ModbusLimits limits;
  limits.client_share = modbus::ClientShare(needs, limit);
  if (limits.client_share < 1) {
    log::Warn("modbus: {}", modbus::ExplainClientShare(needs, limit));
  }
  return limits;
}

}  // namespace

struct Daemon::Impl final : CommandSink, LineControl {
  Impl(config::Config its_config, const config::Catalog& its_catalog)
      : config(std::move(its_config)), catalog(its_catalog), store(config) {}

  /// Where commands go in.
  CommandSink& Commands() { return writes ? writes->entrance() : *this; }
  bool Submit(WriteCommand command) override {
    LineRunner& runner = *runners[line_of[command.device]];
    return runner.Submit(std::move(command));
  }

  void OnDenied(const DeniedWrite& denied) override {
    store.UpdateStatus(denied.device, [](DeviceStatus& status) {
      ++status.writes[static_cast<std::size_t>(WriteEnd::denied)];
    });
  }

  void Release(std::uint32_t line, Duration time) override { runners[line]->Release(time); }
  void TakeBack(std::uint32_t line) override { runners[line]->TakeBack(); }
  void SetInUse(std::uint32_t device, bool in_use) override {
    runners[line_of[device]]->SetInUse(device, in_use);
  }
  std::shared_ptr<TraceQueue> Trace(std::uint32_t line, std::function<void()> wake) override {
    return runners[line]->recorder().Subscribe(std::move(wake));
  }
  std::vector<TraceRecord> Recorded(std::uint32_t line) override {
    return runners[line]->recorder().Recorded();
  }

  Status OpenState();
  Status PlaceEvents(const std::string& why_no_state, EventsPlace& place);
  Status StartHistory(const std::string& why_no_state);
  void MakeLines();
  Status StartModbus();
  Status StartDds();
  void StopDds();
  void StopModbus();
  control::GatewayInfo GatewayForStatus() const;
  void StartControl();
  void StopControl();
  void EndLines();
  void OnLoop(const LoopWatch::Change& change);
  modbus::GatewayFigures Info() const;

  const config::Config config;
  const config::Catalog& catalog;
  PointStore store;
  std::unique_ptr<Recordings> recordings;  // nothing: nowhere to keep them
  std::unique_ptr<StateFolder> state;      // nothing: nothing is kept
  std::unique_ptr<DeviceMemory> memory;
  std::unique_ptr<StateFolder> databases;          // nothing: they lie in `state`
  std::unique_ptr<StateFolder> histories;          // nothing: it lies in `state` or `databases`
  std::unique_ptr<history::HistoryLog> history;    // nothing: no values are kept
  std::unique_ptr<WritePath> writes;               // nothing: nothing is written, or nothing kept
  std::vector<std::unique_ptr<LoopThread>> loops;  // the shared ones first
  LoopWatch watch;
  std::unique_ptr<AgeTimer> ageing;
  std::unique_ptr<HostClock> host_clock;
  std::vector<std::unique_ptr<LineRunner>> runners;
  std::vector<std::size_t> line_of;   // by device
  std::unique_ptr<EventPath> events;  // nothing: none are kept
  Instant started = ReadClocks().instant;
  modbus::ModbusLimits limits;
  asio::io_context modbus_io{1};
  std::unique_ptr<modbus::ModbusServer> modbus;
  std::thread modbus_thread;
  asio::io_context control_io{1};  // of its own: long answers must not delay registers
  std::unique_ptr<control::ControlServer> control;
  std::thread control_thread;
#ifdef BAUDGATE_WITH_DDS
  std::unique_ptr<DdsOutput> dds;
#endif
};

Daemon::Daemon(config::Config config, const config::Catalog& catalog)
    : impl_(std::make_unique<Impl>(std::move(config), catalog)) {
  mallopt(M_ARENA_MAX, kMostArenas);
}

Daemon::~Daemon() {
  Stop();
  impl_->EndLines();
}

Status Daemon::Start() {
  impl_->limits = LimitsOf(impl_->config);
  if (Status status = impl_->OpenState(); !status) return status;
  impl_->MakeLines();
  // The port first: a gateway that is started twice must not publish, and then end, the points
  // of the one that runs already under the same name.
  if (Status status = impl_->StartModbus(); !status) return status;
  if (Status status = impl_->StartDds(); !status) return status;
  if (impl_->events) impl_->events->Started();
  impl_->ageing->Start();
  for (const auto& loop : impl_->loops) loop->Start();
  for (const auto& runner : impl_->runners) runner->Start();
  impl_->host_clock = std::make_unique<HostClock>([impl = impl_.get()](bool right) {
    for (const auto& runner : impl->runners) runner->OnHostClock(right);
  });
  if (impl_->events) impl_->events->Start();
  if (impl_->writes) impl_->writes->Start();
  impl_->StartControl();
  return {};
}

bool Daemon::Stop() {
  if (impl_->host_clock) impl_->host_clock->RequestStop();
  impl_->StopControl();
  impl_->StopModbus();
#ifdef BAUDGATE_WITH_DDS
  if (impl_->dds) impl_->dds->StopWrites();
#endif
  if (impl_->writes) impl_->writes->Stop();
  impl_->history.reset();  // before lines that end look as if their devices were lost
  for (const auto& runner : impl_->runners) runner->RequestStop();
  const Instant deadline = ReadClocks().instant + kPatienceWithLines;
  bool ended = true;
  for (std::size_t line = 0; line < impl_->runners.size(); ++line) {
    if (impl_->runners[line]->StopBefore(deadline)) continue;
    ended = false;
    log::Warn({.line = impl_->config.lines[line].name},
              "does not end: a call of its driver does not come back; the gateway ends without it");
  }
  impl_->host_clock.reset();
  if (ended) impl_->EndLines();
  impl_->StopDds();
  log::TellRepeats();
  return ended;
}

bool Daemon::Look() {
  for (const LoopWatch::Change& change : impl_->watch.Look(ReadClocks().wall)) {
    impl_->OnLoop(change);
  }
  return impl_->watch.complete();
}

const config::Config& Daemon::config() const { return impl_->config; }
const PointStore& Daemon::store() const { return impl_->store; }
LineControl& Daemon::control() { return *impl_; }

std::string Daemon::Summary() const {
  std::string text;
  if (impl_->modbus) {
    for (std::size_t i = 0; i < impl_->config.modbus.listen.size(); ++i) {
      const config::Listener& listener = impl_->config.modbus.listen[i];
      const bool tcp = listener.protocol == config::Listener::Protocol::tcp;
      text += listener.is_serial()
                  ? fmt::format("a Modbus master on {}, ", listener.path)
                  : fmt::format("{} on {}:{}, ", tcp ? "Modbus TCP" : "Modbus RTU over TCP",
                                listener.host, impl_->modbus->port(i));
    }
  }
#ifdef BAUDGATE_WITH_DDS
  if (impl_->dds) text += fmt::format("DDS domain {}, ", impl_->config.dds.domain);
#endif
  return text + fmt::format("{}, {}", Plural(impl_->config.lines.size(), "line"),
                            Plural(impl_->store.device_count(), "device"));
}

/// Only where something is kept: a gateway without such devices leaves no trace on the disk.
Status Daemon::Impl::OpenState() {
  if (!NeedsState(config, catalog)) return {};
  const auto path = StateFolderOf(StatePlaces::Here(config.state), config.name);
  StateFolder::Failure failure{false, "there is no place for it"};
  if (!path.empty()) state = StateFolder::Open(path, failure);
  if (failure.in_use) return Error{failure.text};
  EventsPlace place;
  if (Status status = PlaceEvents(failure.text, place); !status) return status;
  if (Status status = StartHistory(failure.text); !status) return status;
  writes = std::make_unique<WritePath>(config, store, *this, place);
  if (KeepsEvents(config)) {
    events = std::make_unique<EventPath>(
        config, store, place, *this, [this](std::uint32_t device, std::string said, bool reported) {
          runners[line_of[device]]->OnEventsKept(device, std::move(said), reported);
        });
  }
  if (state) {
    memory = std::make_unique<DeviceMemory>(
        state->path() / "devices.json", config,
        [](const std::string& trouble) { log::Warn("{}", trouble); });
    return {};
  }
  log::Warn(
      "state: {}: what is learned of devices is forgotten at the next start; give a folder with "
      "gateway.state",
      failure.text);
  return {};
}

/// In a folder of their own, if the configuration gives one.
Status Daemon::Impl::PlaceEvents(const std::string& why_no_state, EventsPlace& place) {
  constexpr const char* kEventsFile = "events.db";
  StateFolder::Failure failure{false, why_no_state};
  if (const auto path = EventsFolderOf(config); !path.empty()) {
    databases = StateFolder::Open(path, failure);
    if (failure.in_use) return Error{failure.text};
    if (databases) place.file = databases->path() / kEventsFile;
  } else if (state) {
    place.file = state->path() / kEventsFile;
  }
  place.why_no_file = "there is no state folder for it: " + failure.text;
  return {};
}

/// In a folder of its own, if the configuration gives one.
Status Daemon::Impl::StartHistory(const std::string& why_no_state) {
  if (!config.history.on()) return {};
  StateFolder::Failure failure{false, why_no_state};
  const auto path = HistoryFolderOf(config);
  const StateFolder* folder = state.get();
  if (!path.empty() && databases && databases->path() == path) {
    folder = databases.get();
  } else if (!path.empty()) {
    histories = StateFolder::Open(path, failure);
    if (failure.in_use) return Error{failure.text};
    folder = histories.get();
  }
  history = MakeHistory(config, store, folder == nullptr ? std::filesystem::path() : folder->path(),
                        "there is no folder for it: " + failure.text);
  return {};
}

void Daemon::Impl::MakeLines() {
  const auto find = [this](const std::string& name) -> const Protocol& {
    return *catalog.FindProtocol(name);
  };
  LineRecorder::Sink sink;
  if (const auto folder = Recordings::FolderOf(config); !folder.empty()) {
    recordings = std::make_unique<Recordings>(
        folder, kVersion, [](const std::string& trouble) { log::Warn("{}", trouble); });
    sink = [this](Recording recording) { recordings->Save(std::move(recording)); };
  }
  const Placement placement = PlaceLines(config.lines, std::thread::hardware_concurrency());
  while (loops.size() < placement.loops) {
    const std::string name = fmt::format("lines {}", loops.size() + 1);
    loops.push_back(std::make_unique<LoopThread>(name));
    watch.Add(name, {}, AskOn(loops.back()->io()));
  }
  ageing = std::make_unique<AgeTimer>(loops.front()->io(), [this](Instant now) { store.Age(now); });
  for (const config::Line& line : config.lines) {
    const std::uint32_t first_device = config::FirstDevice(config, runners.size());
    std::size_t loop = placement.loop_of[runners.size()];
    if (loop == Placement::kOwn) {
      loop = loops.size();
      loops.push_back(std::make_unique<LoopThread>("line " + line.name));
      watch.Add("line " + line.name, static_cast<std::uint32_t>(runners.size()),
                AskOn(loops.back()->io()));
    }
    line_of.insert(line_of.end(), line.devices.size(), runners.size());
    runners.push_back(std::make_unique<LineRunner>(loops[loop]->io(), line, first_device, find,
                                                   store, sink, memory.get(), events.get()));
  }
}

/// Waits for every driver.
void Daemon::Impl::EndLines() {
  for (const auto& runner : runners) runner->Stop();
  if (events) events->End();
  StopDds();
  events.reset();  // keeps what is left; the loops still hear of it
  for (const auto& loop : loops) loop->Stop();
}

void Daemon::Impl::OnLoop(const LoopWatch::Change& change) {
  const bool stuck = change.stuck_since.has_value();
  if (!change.line) {
    if (!stuck) return log::Info("{}: its thread runs again", change.loop);
    return log::Fail("{}: its thread hangs; until it runs again, systemd's watchdog gets no sign",
                     change.loop);
  }
  runners[*change.line]->SetStuck(change.stuck_since);
  const log::About about{.line = config.lines[*change.line].name};
  if (!stuck) return log::Info(about, "its thread runs again");
  log::Warn(about,
            "its thread hangs: the driver of {} does not come back from a call; all other lines "
            "go on",
            config.lines[*change.line].port);
}

Status Daemon::Impl::StartModbus() {
  if (!config.modbus.enabled) return {};
  modbus::ModbusLinks links;
  for (const auto& runner : runners) links.lines.push_back(runner.get());
  links.rtu = catalog.RtuProtocol();
  if (writes) links.writes = &writes->log();
  if (events) {
    links.events = events->feed();
    links.alarms = &events->log();
  }
  modbus = std::make_unique<modbus::ModbusServer>(
      config, store, Commands(), [this] { return Info(); }, limits, std::move(links));
  if (Status status = modbus->Listen(modbus_io); !status) {
    modbus.reset();
    return status;
  }
  watch.Add("modbus", {}, AskOn(modbus_io));
  modbus_thread = std::thread([this] {
    pthread_setname_np(pthread_self(), "modbus");
    const auto work = asio::make_work_guard(modbus_io);
    modbus_io.run();
  });
  return {};
}

void Daemon::Impl::StopModbus() {
  if (!modbus_thread.joinable()) return;
  asio::post(modbus_io, [this] {
    modbus->Stop();
    modbus_io.stop();
  });
  modbus_thread.join();
}

control::GatewayInfo Daemon::Impl::GatewayForStatus() const {
  control::GatewayInfo info{kVersion, started, modbus.get()};
  if (writes) info.audit = &writes->log();
  if (events) info.events = &events->log();
  info.history = history.get();
  info.stuck_since = [this](std::uint32_t line) { return runners[line]->stuck_since(); };
#ifdef BAUDGATE_WITH_DDS
  if (dds) info.dds = [this] { return dds->state(); };
#endif
  return info;
}

/// A gateway that can not be asked still polls.
void Daemon::Impl::StartControl() {
  control = std::make_unique<control::ControlServer>(config, store, *this, Commands(),
                                                     GatewayForStatus(), control_io);
  if (const Status status = control->Listen(); !status) {
    control.reset();
    log::Warn(
        "no control socket, so 'baudgate status' and the like will not work: {}; choose a "
        "place with gateway.socket",
        status.error());
    return;
  }
  log::Info("control socket {}", control->path());
  watch.Add("control", {}, AskOn(control_io));
  control_thread = std::thread([this] {
    pthread_setname_np(pthread_self(), "control");
    const auto work = asio::make_work_guard(control_io);
    control_io.run();
  });
}

void Daemon::Impl::StopControl() {
  if (!control_thread.joinable()) return;
  asio::post(control_io, [this] {
    control->Stop();
    control_io.stop();
  });
  control_thread.join();
}

Status Daemon::Impl::StartDds() {
  if (!config.dds.enabled) return {};
#ifdef BAUDGATE_WITH_DDS
  auto output = DdsOutput::Start(config, store, Commands(), events ? events->feed() : nullptr);
  if (!output) return Error{output.error()};
  dds = std::move(*output);
#else
  log::Warn("dds: this build has no DDS; set dds.enabled to false to silence this line");
#endif
  return {};
}

void Daemon::Impl::StopDds() {
#ifdef BAUDGATE_WITH_DDS
  if (dds) dds->Stop();
  dds.reset();
#endif
}

modbus::GatewayFigures Daemon::Impl::Info() const {
  modbus::GatewayFigures info;
  info.version_major = kVersionMajor;
  info.version_minor = kVersionMinor;
  info.version_patch = kVersionPatch;
  info.uptime = ReadClocks().instant - started;
  info.lines = runners.size();
  for (const auto& runner : runners) info.lines_up += runner->is_open() ? 1 : 0;
  info.devices = store.device_count();
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    store.Read(device, [&](const DeviceRecord& record) {
      // A device keeps its state while its line is down.
      info.devices_online += Answers(record.status.state) && !record.override_quality ? 1 : 0;
    });
  }
  return info;
}

}  // namespace baudgate
