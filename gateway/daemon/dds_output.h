// The DDS output as the configuration wants it: a publisher and, for `process: own`, the process
// that speaks DDS; for `process: inside` a module with the library.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/dds/link/process_link.h"
#include "gateway/dds/publisher.h"
#include "gateway/store/point_store.h"

namespace baudgate {

class DdsOutput {
 public:
  /// Both outlive it. The error says which name or setting to change; a process that can not be had
  /// is a state.
  static Result<std::unique_ptr<DdsOutput>> Start(const config::Config& config, PointStore& store);
  ~DdsOutput();  ///< as Stop

  /// Tells subscribers the end; within about a second. Idempotent.
  void Stop();
  /// From any thread.
  dds::LinkState state() const;

 private:
  DdsOutput() = default;

  std::unique_ptr<dds::ProcessLink> link_;  // nothing: inside
  std::unique_ptr<dds::DdsPublisher> publisher_;
};

}  // namespace baudgate
