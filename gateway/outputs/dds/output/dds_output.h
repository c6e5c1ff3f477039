// `DdsOutput` is the DDS output of the gateway: a publisher, the link to the process baudgate-dds,
// and, with `write: allow`, the service for write requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/outputs/dds/link/process_link.h"
#include "gateway/outputs/dds/output/event_samples.h"
#include "gateway/outputs/dds/publisher.h"
#include "gateway/outputs/dds/writes/write_service.h"
#include "gateway/outputs/output.h"

namespace baudgate::dds {

inline constexpr outputs::Metric kDdsSamples{"baudgate_dds_samples_total", "counter",
                                             "Samples that were published."};

class DdsOutput final : public outputs::Output {
 public:
  /// All references must stay valid for the lifetime of the output.
  struct Links {
    bus::PointStore& store;
    bus::CommandSink& sink;
    bus::RequestBook::Past past;                 ///< returns the write requests of earlier runs
    std::shared_ptr<dds::EventSupply> events{};  ///< null: no events and no alarms
    bool keeps_events = false;                   ///< false: only alarms are published, no events
  };
  explicit DdsOutput(Links links) : links_(std::move(links)) {}
  static outputs::DescriptorNeeds Descriptors(const config::Config& config) {
    return {.others = config.dds.enabled ? std::size_t(64) : 0};
  }
  /// Returns the name under which the last event that DDS has sent is stored (OutputRow::consumer);
  /// empty: DDS is off.
  static std::string Consumer(const config::Config& config) {
    return config.dds.enabled ? EventSamples::kConsumer : "";
  }
  ~DdsOutput() override { DdsOutput::Stop(); }

  std::string_view name() const override { return "dds"; }
  /// Starts the output. An error contains the name or setting to change. If baudgate-dds cannot be
  /// started, that is not an error: the status reports it.
  Status Open(const Configuration& config) override;
  void Examine(const config::Config& next, std::vector<std::string>& settings,
               std::vector<std::string>& restart) const override;
  std::vector<std::string> Apply(const Configuration& config,
                                 std::unique_ptr<Prepared> prepared) override;
  /// After StopRequests, no write is passed to the sink. Writes in progress still get their
  /// replies.
  void StopRequests() override;
  /// Publishes all points as not connected, which takes up to about two seconds.
  void Stop() override;
  std::string Summary() override;
  std::optional<Json> Section(const Wish& wish) const override;
  std::vector<outputs::Series> Metrics() const override;

 private:
  dds::LinkState state() const;

  Links links_;
  int domain_ = 0;
  std::unique_ptr<dds::ProcessLink> link_;
  std::unique_ptr<dds::DdsWrites> writes_;
  std::unique_ptr<dds::DdsPublisher> publisher_;
};

}  // namespace baudgate::dds
