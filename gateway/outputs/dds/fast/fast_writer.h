// `CreateFastWriter` makes the SampleWriter that uses Fast DDS, with a participant of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

/// The object owns the participant and the writers of all topics. `requests_for`: the gateway whose
/// write requests are received; empty: none. The error says what to change in `dds:`.
Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const ParticipantOptions& options,
                                                       const Room& room,
                                                       const std::string& requests_for = {});
/// As above, for all points and devices of `store`, with the options of `config.dds`.
Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const config::Config& config,
                                                       const bus::PointStore& store);

}  // namespace baudgate::dds
