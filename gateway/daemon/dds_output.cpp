// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/dds_output.h"

#include <cstdlib>
#include <string>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/outputs/dds/point_slots.h"

namespace baudgate {
namespace {

/// systemd starts baudgate-dds, which connects to this path; see packaging/baudgate-dds.service.
constexpr char kSocketVariable[] = "BAUDGATE_DDS_SOCKET";

void Log(log::Level level, const std::string& line) { log::Write(level, "dds: " + line); }

dds::LinkOpen OpenFor(const config::Config& config, const PointStore& store) {
  dds::LinkOpen open;
  open.gateway = config.name;
  open.participant = dds::ParticipantOf(config.dds);
  open.requests = config.dds.write;
  open.room = dds::RoomFor(store);
  return open;
}

}  // namespace

Result<std::unique_ptr<DdsOutput>> DdsOutput::Start(const config::Config& config, PointStore& store,
                                                    CommandSink& sink, RequestBook::Past past,
                                                    std::shared_ptr<dds::EventSupply> events,
                                                    bool keeps_events) {
  std::unique_ptr<DdsOutput> output(new DdsOutput);
  dds::ProcessLinkOptions options;
  options.open = OpenFor(config, store);
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
  const Status names = dds::DdsPublisher::CheckNames(next);
  return names ? std::nullopt : std::optional(names.error());
}

void DdsOutput::OnReload() { publisher_->OnReload(); }

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
