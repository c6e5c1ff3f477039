// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/daemon.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/shown.h"
#include "gateway/base/version.h"
#include "gateway/daemon/daemon_impl.h"
#include "gateway/daemon/descriptors.h"

namespace baudgate::daemon {
namespace {

/// glibc gives every thread a separate memory arena; with a thread per line this would waste
/// memory.
constexpr int kMostArenas = 2;

}  // namespace

Daemon::Daemon(config::Config config, const config::Catalog& catalog)
    : impl_(std::make_unique<Impl>(std::move(config), catalog)) {
  mallopt(M_ARENA_MAX, kMostArenas);
}

Daemon::~Daemon() {
  Stop();
  impl_->EndLines();
}

Status Daemon::Start() {
  // The limit of open files is raised first, because each line opens some files.
  RaiseDescriptorLimit(DescriptorNeedsOf(impl_->config, impl_->output_rows).all());
  if (Status status = impl_->OpenRecords(); !status) return status;
  impl_->MakeLines();
  impl_->MakeOutputs();
  if (Status status = impl_->OpenOutputs(); !status) return status;
  records::EventPath* const events = impl_->records.events();
  if (events != nullptr) events->Started();
  impl_->MakeClocks();
  impl_->certificates.Apply(impl_->config);
  impl_->ticker->Start();
  impl_->lines.Start();
  impl_->host_clock = std::make_unique<HostClock>([impl = impl_.get()](bool right) {
    impl->lines.OnHostClock(right);
    impl->clocks->OnHostClock(right);
  });
  if (events != nullptr) events->Start();
  if (records::WritePath* const writes = impl_->records.write_path()) writes->Start();
  if (Status status = impl_->BeginOutputs(); !status) return status;
  if (impl_->reloader) impl_->reloader->Start();
  return {};
}

bool Daemon::Stop() {
  if (impl_->host_clock) impl_->host_clock->RequestStop();
  if (impl_->reloader) impl_->reloader->Stop();
  for (const auto& output : impl_->outputs) output->StopRequests();
  if (impl_->clocks) impl_->clocks->Stop();
  if (records::WritePath* const writes = impl_->records.write_path()) writes->Stop();
  impl_->records.EndHistory();
  const std::vector<std::string> hang = impl_->lines.Stop();
  for (const std::string& line : hang) {
    log::Warn({.line = line},
              "the driver of the port does not return from a call, so the line cannot be stopped. "
              "The gateway ends without waiting for the line");
  }
  impl_->host_clock.reset();
  if (hang.empty()) impl_->EndLines();
  impl_->StopOutputs();
  log::TellRepeats();
  return hang.empty();
}

bool Daemon::Look() { return impl_->lines.Look(ReadClocks().wall); }

void Daemon::Add(OutputRow output) { impl_->output_rows.push_back(std::move(output)); }

std::vector<std::string_view> Daemon::outputs() const {
  std::vector<std::string_view> names;
  for (const auto& output : impl_->outputs) names.push_back(output->name());
  return names;
}

void Daemon::SetReload(ReloadOptions options) { impl_->SetReload(std::move(options)); }

void Daemon::Reload(const std::string& by) {
  if (!impl_->reloader) return;
  control::ReloadAsk ask;
  ask.by = by;
  impl_->reloader->Reload(ask, [](const control::ReloadAnswer&) {});
}

const config::Config& Daemon::config_at_start() const { return impl_->config; }
const bus::PointStore& Daemon::store() const { return impl_->store; }
lines::LineControl& Daemon::control() { return impl_->dispatcher; }

std::string Daemon::Summary() const {
  std::string text;
  for (const auto& output : impl_->outputs) {
    const std::string summary = output->Summary();
    if (!summary.empty()) text += summary + ", ";
  }
  return text + fmt::format("{}, {}", Plural(impl_->lines.present(), "line"),
                            Plural(impl_->store.present_count(), "device"));
}

Status Daemon::Impl::OpenRecords() {
  std::set<std::string> consumers;
  for (const OutputRow& row : output_rows) {
    if (row.consumer) consumers.insert(row.consumer(config));
  }
  consumers.erase("");
  const records::Records::Links links{
      store,
      dispatcher,
      [this](std::uint32_t device, const std::string& said, bool reported) {
        lines.OfDevice(device).Post([=](lines::LineParts& line, Now now) {
          line.OnEventsKept(device, said, reported, now);
        });
      },
      [this](const std::set<audit::Target>& devices) { TellUnsettled(devices); },
      troubles,
      std::move(consumers)};
  if (records::NeedsState(config, catalog)) return records.Open(config, links);
  records.OpenAlarms(config, links);
  return {};
}

void Daemon::Impl::TellUnsettled(const std::set<audit::Target>& devices) {
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    const auto line = store.line(device);
    const auto its = store.device(device);
    if (store.gone(device) || !its || !devices.contains({line->name, its->name})) continue;
    lines.OfDevice(device).Post(
        [device](lines::LineParts& parts, Now) { parts.poller.OnUnsettledWrite(device); });
  }
}

void Daemon::Impl::MakeLines() {
  lines::LineParts::Links links{
      .memory = records.memory(), .events = records.events(), .foreign = catalog.ForeignRules()};
  links.loans.journal = &journal;
  if (records::WritePath* const writes = records.write_path()) {
    links.loans.log = &writes->log();
    links.loans.required = config.audit == config::Audit::require;
  }
  if (const auto folder = records::Recordings::FolderOf(config); !folder.empty()) {
    recordings = std::make_unique<records::Recordings>(folder, kVersion,
                                                       troubles.Reporter("a trace of failures"));
    links.recordings = [this](records::Recording recording) {
      recordings->Save(std::move(recording));
    };
  }
  lines.Link(std::move(links));
  ticker = std::make_unique<Ticker>(lines.io(), [this](Instant now) {
    store.Age(now);
    const Now both{now, ReadClocks().wall};
    clocks->Tick(both);
    certificates.Tick(both);
    records.Look(both, certificates.Alarm(both.wall));
  });
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
    AddLine(store.LineAt(line), nullptr);
  }
}

void Daemon::Impl::AddLine(std::shared_ptr<const config::Line> line,
                           std::shared_ptr<transports::LoopThread> own) {
  if (!own) {
    auto made = lines::Lines::MakeLoop(*line);
    if (made) own = *std::move(made);
    if (!made)
      log::Warn(
          "{}. This line shares a thread with other lines, so they stand still while the driver of "
          "its port blocks",
          made.error());
  }
  lines.Add(std::move(line), std::move(own));
}

void Daemon::Impl::MakeClocks() {
  const auto tell = [this](std::uint32_t device, bool corrected, const std::string& text, Now at) {
    const log::About about{.line = store.line(device)->name, .device = store.device(device)->name};
    if (corrected) {
      log::Info(about, "clock corrected: {}", text);
    } else {
      log::Warn(about, "clock not corrected: {}", text);
    }
    if (records.events() != nullptr) records.events()->OnClock(device, corrected, text, at);
  };
  const auto warn = [](const std::string& trouble) { log::Warn("{}", trouble); };
  ClockCorrector::Links links{store, Commands(), nullptr, tell, warn};
  if (const records::StateFolder* const state = records.state()) {
    links.open = [file = state->path() / "clocks.json", warn,
                  trouble = troubles.Reporter("clocks.json")](const config::Config& its) {
      return std::make_unique<records::DeviceMemory>(file, its, warn, trouble);
    };
  }
  clocks = std::make_unique<ClockCorrector>(std::move(links));
  clocks->OnReload(config);
}

void Daemon::Impl::EndLines() {
  lines.End();
  if (records::EventPath* const events = records.events()) events->End();
  StopOutputs();
  records.EndEvents();
  lines.StopLoops();
}

// ---------------------------------------------------------------- outputs

void Daemon::Impl::PlaceJournal(const config::Config& its) {
  if (const records::StateFolder* const state = records.state()) {
    journal.SetFolder(state->path());
  } else if (!its.users.file.empty()) {
    journal.SetFolder(
        records::StateFolderOf(records::StatePlaces::Here(config.state), config.name));
  }
}

void Daemon::Impl::MakeOutputs() {
  PlaceJournal(config);
  const status::GatewayInfo info = GatewayForStatus();
  const auto needs = [this](const config::Config& its) {
    return DescriptorNeedsOf(its, output_rows);
  };
  const OutputLinks links{config,     catalog, store,          lines, dispatcher,
                          Commands(), records, reloader.get(), info,  needs};
  for (const OutputRow& row : output_rows) outputs.push_back(row.make(links));
}

Status Daemon::Impl::OpenOutputs() {
  for (const auto& output : outputs) {
    if (Status status = output->Open(running); !status) return status;
  }
  return {};
}

Status Daemon::Impl::BeginOutputs() {
  for (const auto& output : outputs) {
    output->SetHistory(running, records.history());
    if (Status status = output->Begin(running); !status) return status;
    if (auto* const loop = output->loop()) lines.Watch(std::string(output->name()), *loop);
  }
  return {};
}

void Daemon::Impl::StopOutputs() {
  for (const auto& output : outputs) output->Stop();
}

status::GatewayInfo Daemon::Impl::GatewayForStatus() {
  status::GatewayInfo info{kVersion, started, &outputs};
  if (records.write_path() != nullptr) info.audit = &records.write_path()->log();
  if (records.events() != nullptr) info.events = &records.events()->log();
  info.history = records.history();
  if (reloader) info.reload = [this] { return reloader->state(); };
  info.files = [this] {
    const OpenFiles::Count count = open_files.Now();
    std::vector<std::string> all = troubles.all();
    std::ranges::move(certificates.Sentences(ReadClocks().wall), std::back_inserter(all));
    return status::FilesState{count.open, count.limit, std::move(all)};
  };
  info.certificates = [this] { return certificates.ends(); };
  info.journal = &journal;
  info.stuck_since = [this](std::uint32_t line) { return lines.stuck_since(line); };
  return info;
}

}  // namespace baudgate::daemon
