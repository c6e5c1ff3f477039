// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/dds_output.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

/// systemd starts baudgate-dds, which connects to this path; see packaging/baudgate-dds.service.
constexpr char kSocketVariable[] = "BAUDGATE_DDS_SOCKET";
constexpr std::uint32_t kSpare = 512;

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
  ++open.events;  // the gateway has some itself, at least alarms
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

}  // namespace

Result<std::unique_ptr<DdsOutput>> DdsOutput::Start(const config::Config& config, PointStore& store,
                                                    CommandSink& sink, dds::WriteService::Past past,
                                                    std::shared_ptr<dds::EventSupply> events,
                                                    bool keeps_events) {
  std::unique_ptr<DdsOutput> output(new DdsOutput);
  dds::ProcessLinkOptions options;
  options.open = OpenFor(config, store);
  output->opened_ = options.open;
  output->seen_ = NamesOf(config);
  if (const char* socket = std::getenv(kSocketVariable)) options.socket = socket;
  auto link = dds::ProcessLink::Create(std::move(options), Log);
  if (!link) return Error{link.error()};
  output->link_ = std::move(*link);
  const std::shared_ptr<dds::SampleWriter> writer = output->link_->writer();
  output->has_events_ = keeps_events;
  auto publisher = dds::DdsPublisher::Create(config, store, writer, Log, std::move(events));
  if (!publisher) return Error{publisher.error()};
  output->publisher_ = std::move(*publisher);
  if (config.dds.write) {
    output->writes_ =
        std::make_unique<dds::DdsWrites>(config, store, sink, std::move(past), writer);
  }
  return output;
}

DdsOutput::~DdsOutput() { Stop(); }

std::optional<std::string> DdsOutput::WhyNot(const config::Config& next) const {
  if (const Status names = dds::DdsPublisher::CheckNames(next); !names) return names.error();
  auto all = NamesOf(next);
  all.insert(seen_.begin(), seen_.end());
  if (all.size() > opened_.points) {
    return "dds (more than the " + std::to_string(opened_.points) +
           " points that there is room for)";
  }
  return std::nullopt;
}

void DdsOutput::OnReload(const config::Config& config) {
  seen_.merge(NamesOf(config));
  publisher_->OnReload();
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
  dds::LinkState state = link_->state();
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

}  // namespace baudgate
