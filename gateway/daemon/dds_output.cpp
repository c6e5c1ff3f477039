// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/dds_output.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/daemon/event_samples.h"
#include "gateway/daemon/modules.h"
#include "gateway/dds/inside_module.h"
#include "gateway/state/state_folder.h"

namespace baudgate {
namespace {

/// systemd starts baudgate-dds, which connects to this path; see packaging/baudgate-dds.service.
constexpr char kSocketVariable[] = "BAUDGATE_DDS_SOCKET";
constexpr std::uint32_t kSpare = 512;
constexpr char kInsideModule[] = "baudgate-dds-inside.so";

void Log(log::Level level, const std::string& line) { log::Write(level, "dds: " + line); }

dds::LinkOpen OpenFor(const config::Config& config, const PointStore& store) {
  dds::LinkOpen open;
  open.gateway = config.name;
  open.participant = dds::ParticipantOf(config.dds);
  open.requests = config.dds.write;
  open.devices = store.device_count();
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    const config::Device& its = store.device(device);
    open.points += static_cast<std::uint32_t>(its.points.size());
    if (its.events || its.point_events) ++open.events;
  }
  if (KeepsEvents(config)) ++open.events;  // the gateway has some itself
  // Room for what reloads bring: a name that was published once takes its place for good.
  open.points += open.points / 4 + kSpare;
  open.devices += open.devices / 4 + kSpare / 8;
  return open;
}

std::unordered_set<std::size_t> NamesOf(const config::Config& config) {
  std::unordered_set<std::size_t> names;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      for (const config::Point& point : device.points) {
        names.insert(std::hash<std::string>()(device.name + "." + point.name));
      }
    }
  }
  return names;
}

Result<void*> LoadInside() {
  std::string tried;
  for (const std::filesystem::path& root : ModuleRoots()) {
    const std::filesystem::path path = root / kInsideModule;
    std::error_code error;
    if (!std::filesystem::exists(path, error)) {
      tried += (tried.empty() ? "" : ", ") + root.string();
      continue;
    }
    void* handle = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) return Error{std::string("dds: ") + ::dlerror()};
    return handle;
  }
  return Error{std::string("dds: process: inside needs ") + kInsideModule + ", which is not in " +
               tried + "; install it, or write process: own"};
}

Result<std::shared_ptr<dds::SampleWriter>> MakeInsideWriter(const dds::LinkOpen& open) {
  const auto handle = LoadInside();
  if (!handle) return Error{handle.error()};
  const auto tag = reinterpret_cast<decltype(&baudgate_dds_inside_tag)>(
      ::dlsym(*handle, "baudgate_dds_inside_tag"));
  const auto make =
      reinterpret_cast<decltype(&baudgate_dds_inside)>(::dlsym(*handle, "baudgate_dds_inside"));
  if (tag == nullptr || make == nullptr || dds::InsideTag() != tag()) {
    return Error{std::string("dds: ") + kInsideModule + " is not " + dds::InsideTag() +
                 "; install the one of this release"};
  }
  std::string error;
  dds::SampleWriter* writer =
      make(open.participant, open.points, open.devices,
           open.requests ? open.gateway : std::string(), open.events, error);
  if (writer == nullptr) return Error{error};
  return std::shared_ptr<dds::SampleWriter>(writer);
}

}  // namespace

Result<std::unique_ptr<DdsOutput>> DdsOutput::Start(const config::Config& config, PointStore& store,
                                                    CommandSink& sink,
                                                    std::shared_ptr<events::EventFeed> events) {
  std::unique_ptr<DdsOutput> output(new DdsOutput);
  std::shared_ptr<dds::SampleWriter> writer;
  const dds::LinkOpen open = OpenFor(config, store);
  output->opened_ = open;
  output->seen_ = NamesOf(config);
  if (config.dds.process == config::Dds::Process::inside) {
    auto inside = MakeInsideWriter(open);
    if (!inside) return Error{inside.error()};
    writer = std::move(*inside);
  } else {
    dds::ProcessLinkOptions options;
    options.open = open;
    if (const char* socket = std::getenv(kSocketVariable)) options.socket = socket;
    auto link = dds::ProcessLink::Create(std::move(options), Log);
    if (!link) return Error{link.error()};
    output->link_ = std::move(*link);
    writer = output->link_->writer();
  }
  std::shared_ptr<dds::EventSupply> samples;
  if (events) samples = std::make_shared<EventSamples>(config.name, std::move(events));
  output->has_events_ = samples != nullptr;
  auto publisher = dds::DdsPublisher::Create(config, store, writer, Log, std::move(samples));
  if (!publisher) return Error{publisher.error()};
  output->publisher_ = std::move(*publisher);
  if (config.dds.write) {
    output->writes_ = std::make_unique<dds::DdsWrites>(config, store, sink, writer);
  }
  output->writer_ = std::move(writer);
  return output;
}

DdsOutput::~DdsOutput() { Stop(); }

std::string DdsOutput::WhyNot(const config::Config& next) const {
  if (const Status names = dds::DdsPublisher::CheckNames(next); !names) return names.error();
  auto all = NamesOf(next);
  all.insert(seen_.begin(), seen_.end());
  if (all.size() > opened_.points) {
    return "dds (more than the " + std::to_string(opened_.points) +
           " points that there is room for)";
  }
  if (opened_.events == 0 && KeepsEvents(next)) return "dds (the topic of events)";
  return {};
}

void DdsOutput::Renumber(const config::Config& config) {
  seen_.merge(NamesOf(config));
  publisher_->Renumber();
}

void DdsOutput::StopWrites() {
  if (writes_) writes_->StopTaking();
}

void DdsOutput::Stop() {
  StopWrites();
  if (writes_) writes_->Stop();
  if (publisher_) publisher_->Stop();
  if (link_) link_->Stop();
}

dds::LinkState DdsOutput::state() const {
  dds::LinkState state = link_ ? link_->state() : StateInside();
  if (has_events_) {
    const dds::DdsCounters counters = publisher_->counters();
    state.events = counters.events;
    state.events_skipped += counters.events_skipped;
  }
  if (!writes_) return state;
  state.requests = writes_->taken();
  state.requests_dropped += writes_->dropped();
  return state;
}

dds::LinkState DdsOutput::StateInside() const {
  const dds::DdsCounters counters = publisher_->counters();
  dds::LinkState state;
  state.phase = dds::LinkState::Phase::up;
  state.heard = ReadClocks().instant;
  state.subscribers = counters.subscribers;
  state.written = counters.written;
  state.refused = counters.failed;
  state.requests_dropped = writer_->dropped_requests();
  state.datagrams = counters.datagrams;
  return state;
}

}  // namespace baudgate
