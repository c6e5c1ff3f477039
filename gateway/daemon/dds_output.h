// The DDS output as the configuration wants it: a publisher, the link to the process that speaks
// DDS, and for `write: allow` the writes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/outputs/dds/event_supply.h"
#include "gateway/outputs/dds/link/process_link.h"
#include "gateway/outputs/dds/publisher.h"
#include "gateway/outputs/dds/writes/dds_writes.h"

namespace baudgate {

class DdsOutput {
 public:
  /// All outlive it; writes go to `sink`. The error says which name or setting to change. A process
  /// that cannot be started is no error but a state.
  /// `past`: see RequestBook. `events` null: no events and no alarms. `keeps_events` false:
  /// only alarms are published.
  static Result<std::unique_ptr<DdsOutput>> Start(const config::Config& config, PointStore& store,
                                                  CommandSink& sink, RequestBook::Past past,
                                                  std::shared_ptr<dds::EventSupply> events,
                                                  bool keeps_events);
  ~DdsOutput();  ///< as Stop

  /// A reload: the store has other devices.
  void OnReload();
  /// Why `next` needs a restart before all of it can be published; empty: it needs none.
  std::optional<std::string> WhyNot(const config::Config& next) const;

  /// No write goes to the sink after this; those under way are answered. Idempotent.
  void StopWrites();
  /// Tells subscribers that all points are gone; within about two seconds. Idempotent.
  void Stop();
  /// From any thread.
  dds::LinkState state() const;

 private:
  DdsOutput() = default;

  bool has_events_ = false;
  std::unique_ptr<dds::ProcessLink> link_;
  std::unique_ptr<dds::DdsWrites> writes_;  // null: writes are denied
  std::unique_ptr<dds::DdsPublisher> publisher_;
};

}  // namespace baudgate
