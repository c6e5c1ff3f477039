// `CreateFastWriter` creates the SampleWriter that uses Fast DDS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

/// Creates a SampleWriter that uses Fast DDS. It owns its participant and the writers of all
/// topics. `requests_for`: name of the gateway whose write requests are received; empty: no write
/// requests are received. The error contains what to change in `dds:`.
Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const ParticipantOptions& options,
                                                       const Room& room,
                                                       const std::string& requests_for = {});
/// Creates a SampleWriter with the options of `config.dds` and space for all points and devices of
/// `store`.
Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const config::Config& config,
                                                       const bus::PointStore& store);

}  // namespace baudgate::dds
