// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/output/dds_output.h"

#include <cstdlib>
#include <string>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/outputs/dds/output/dds_json.h"
#include "gateway/outputs/dds/point_samples.h"

namespace baudgate::dds {
namespace {

/// The variable with the path of the socket to which baudgate-dds connects if systemd starts it
/// (packaging/baudgate-dds.service).
constexpr char kSocketVariable[] = "BAUDGATE_DDS_SOCKET";

void Log(log::Level level, const std::string& line) { log::Write(level, "dds: " + line); }

dds::LinkOpen OpenFor(const config::Config& config, const bus::PointStore& store) {
  dds::LinkOpen open;
  open.gateway = config.name;
  open.participant = dds::ParticipantOf(config.dds);
  open.requests = config.dds.write;
  open.room = dds::RoomFor(store);
  return open;
}

}  // namespace

Status DdsOutput::Open(const Configuration& config) {
  if (!config->dds.enabled) return {};
  domain_ = config->dds.domain;
  dds::ProcessLinkOptions options;
  options.open = OpenFor(*config, links_.store);
  if (const char* socket = std::getenv(kSocketVariable)) options.socket = socket;
  auto link = dds::ProcessLink::Create(std::move(options), Log);
  if (!link) return Error{link.error()};
  const std::shared_ptr<dds::SampleWriter> writer = (*link)->writer();
  auto publisher =
      dds::DdsPublisher::Create(*config, links_.store, writer, Log, std::move(links_.events));
  if (!publisher) return Error{publisher.error()};
  link_ = std::move(*link);
  publisher_ = std::move(*publisher);
  if (config->dds.write) {
    writes_ = std::make_unique<dds::DdsWrites>(*config, links_.store, links_.sink,
                                               std::move(links_.past), writer);
  }
  return {};
}

void DdsOutput::Examine(const config::Config& next, std::vector<std::string>& /*settings*/,
                        std::vector<std::string>& restart) const {
  if (!link_) return;
  const Status names = dds::DdsPublisher::CheckNames(next);
  if (!names) restart.push_back(names.error());
}

std::vector<std::string> DdsOutput::Apply(const Configuration& /*config*/,
                                          std::unique_ptr<Prepared> /*prepared*/) {
  if (publisher_) publisher_->OnReload();
  return {};
}

void DdsOutput::StopRequests() {
  if (writes_) writes_->StopTaking();
}

void DdsOutput::Stop() {
  StopRequests();
  if (writes_) writes_->Stop();
  if (publisher_) publisher_->Stop();
  if (link_) link_->Stop();
}

std::string DdsOutput::Summary() {
  return link_ ? "DDS domain " + std::to_string(domain_) : std::string();
}

std::optional<outputs::Output::Json> DdsOutput::Section(const Wish& wish) const {
  return link_ ? DdsJson(domain_, state(), wish.now.instant) : Json(nullptr);
}

std::vector<outputs::Series> DdsOutput::Metrics() const {
  if (!link_) return {};
  return {outputs::Series(kDdsSamples, static_cast<double>(state().written))};
}

dds::LinkState DdsOutput::state() const {
  dds::LinkState state = link_->state();
  if (links_.keeps_events) {
    const dds::DdsCounters counters = publisher_->counters();
    state.events = counters.events;
    state.events_skipped += counters.events_skipped;
  }
  if (!writes_) return state;
  state.requests = writes_->taken();
  state.requests_dropped += writes_->dropped();
  return state;
}

}  // namespace baudgate::dds
