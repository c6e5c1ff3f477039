// Applies another configuration to a running gateway. First it opens ports, because this can fail.
// Lines that do not change are not touched. Then, in this order: the old lines end; the store gets
// the new lines, before an interlock of a remaining line can name their devices; files and outputs
// change; the new lines start.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "gateway/daemon/daemon_impl.h"
#include "gateway/daemon/reloader.h"

namespace baudgate::daemon {
namespace {

reload::Health HealthOf(const bus::DeviceRecord& record) {
  using reload::Health;
  if (record.override_quality == Quality::bad_out_of_service) return Health::unasked;
  if (record.override_quality == Quality::bad_configuration) return Health::ill;
  // An offline device may still be starting. It is ill only if it has answered before (last_ok),
  // and has been asked since its port came back (override_quality is set).
  if (record.status.state == bus::DeviceState::offline) {
    const bool was_asked = record.status.last_ok && record.override_quality;
    return was_asked ? Health::ill : Health::unknown;
  }
  const bool well = Answers(record.status.state) && !record.override_quality;
  return well ? Health::well : Health::unknown;
}

bool Begins(reload::Action action) {
  return action == reload::Action::added || action == reload::Action::restarted;
}

}  // namespace

void Daemon::Impl::SetReload(ReloadOptions options) {
  Reloader::Links links;
  links.running = [this] { return running; };
  links.keeps = [this] { return records.open(); };
  links.open_folder = [this]() -> Status {
    if (Status status = records.OpenFolder(config); !status) return status;
    if (records.state() == nullptr) return Error{records.why_no_state()};
    return {};
  };
  links.examine = [this](const config::Config& next, reload::Difference& difference) {
    Examine(next, difference);
  };
  links.prepare = [this](config::Config next, const reload::Difference& difference) {
    return Prepare(std::move(next), difference);
  };
  links.healths = [this] { return Healths(); };
  links.tell = [this](bool taken_back, const std::string& text) {
    if (records.events() != nullptr) records.events()->OnReload(taken_back, text);
  };
  reloader = std::make_unique<Reloader>(std::move(options), std::move(links));
}

void Daemon::Impl::Examine(const config::Config& next, reload::Difference& difference) const {
  for (const auto& output : outputs) {
    output->Examine(next, difference.settings, difference.restart);
  }
  std::map<std::string, std::size_t> clients;
  for (const auto& output : outputs) output->CountClients(clients);
  for (reload::ListenerChange& listener : difference.modbus.listeners) {
    listener.clients = clients[listener.place];
  }
  if (records::NeedsState(next, catalog) && !records.open()) {
    difference.restart.push_back("the recording of " + records::WhatIsKept(next, catalog) +
                                 " (its files are opened only when the gateway starts)");
  } else if (records::KeepsEvents(next) && !records.keeps_events()) {
    difference.restart.emplace_back("the recording of events");
  }
}

Reloader::Prepared Daemon::Impl::Prepare(config::Config next,
                                         const reload::Difference& difference) {
  Reloader::Prepared prepared;
  auto outputs_prepared = std::make_shared<PreparedOutputs>();
  for (const auto& output : outputs) {
    auto& one = outputs_prepared->emplace_back(output->Prepare(next));
    for (const std::string& trouble : one->troubles) prepared.troubles.push_back(trouble);
  }
  Threads threads;
  for (std::size_t i = 0; i < next.lines.size(); ++i) {
    if (!Begins(difference.lines[i].action)) continue;
    auto thread = lines::Lines::MakeLoop(next.lines[i]);
    if (!thread) prepared.troubles.push_back(thread.error());
    if (thread) threads.emplace(next.lines[i].name, *std::move(thread));
  }
  prepared.apply = [this, next = std::move(next), difference, outputs_prepared,
                    threads = std::move(threads)]() mutable {
    return Apply(std::move(next), difference, std::move(*outputs_prepared), threads);
  };
  return prepared;
}

std::vector<std::string> Daemon::Impl::Apply(config::Config next,
                                             const reload::Difference& difference,
                                             PreparedOutputs prepared, const Threads& threads) {
  reload::Placement placed = reload::PlaceInSlots(*running, std::move(next), difference);
  const auto before =
      std::exchange(running, std::make_shared<const config::Config>(std::move(placed.config)));
  std::map<std::string, lines::ManualSettings> manual;
  for (const std::uint32_t line : placed.gone) {
    const config::Line& ends = before->lines[line];
    manual.emplace(ends.name, lines::ManualSettingsOf(store, line, ends));
  }
  lines.Remove(placed.gone);
  for (const std::uint32_t line : placed.gone) store.Retire(line);
  std::vector<std::shared_ptr<const config::Line>> begun;
  const std::uint32_t first_device = store.device_count();
  for (const std::uint32_t line : placed.begun) {
    // make_unique, not make_shared, so that weak pointers to the line do not hold its memory.
    begun.push_back(std::make_unique<const config::Line>(running->lines[line]));
    store.Append(begun.back());
  }
  for (const std::uint32_t line : placed.updated) {
    store.Reconfigure(line, std::make_shared<const config::Line>(running->lines[line]));
  }
  records.OnReload(running, begun);
  PlaceJournal(*running);
  clocks->OnReload(*running);
  std::uint32_t device = first_device;
  std::vector<std::uint32_t> started;
  for (const auto& line : begun) {
    const auto own = threads.find(line->name);
    AddLine(line, own == threads.end() ? nullptr : own->second);
    const auto number = static_cast<std::uint32_t>(lines.size() - 1);
    started.push_back(number);
    Restore(manual[line->name], dispatcher, *line, number, device, ReadClocks().wall);
    device += static_cast<std::uint32_t>(line->devices.size());
  }
  // The history refers to points by number, so outputs must not read it while the numbers change.
  const bool renews = before->history.on() || running->history.on();
  if (renews) SetHistory(nullptr);
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (std::string& trouble : outputs[i]->Apply(running, std::move(prepared[i]))) {
      missing.push_back(std::move(trouble));
    }
  }
  certificates.Apply(*running);
  if (renews) records.RenewHistory(running, store);
  SetHistory(records.history());
  lines.Start();
  if (records::EventPath* const events = records.events()) {
    events->Begun(first_device, store.device_count() - first_device);
  }
  // Outputs and events need nothing more of the ended lines, so the store can forget them.
  for (const std::uint32_t line : placed.gone) store.Forget(line);
  for (std::string& trouble : lines.NotOpen(started)) missing.push_back(std::move(trouble));
  return missing;
}

void Daemon::Impl::SetHistory(const std::shared_ptr<const history::HistorySource>& history) {
  for (const auto& output : outputs) output->SetHistory(running, history);
}

reload::Healths Daemon::Impl::Healths() const {
  reload::Healths healths;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    if (store.gone(device)) continue;
    store.Read(device, [&](const bus::DeviceRecord& record) {
      healths.emplace(record.line->name + "." + record.device->name, HealthOf(record));
    });
  }
  return healths;
}

}  // namespace baudgate::daemon
