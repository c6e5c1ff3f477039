// The SampleWriter on Fast DDS, in a participant of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

/// Writers of all topics; participant and writers end with the object. `requests_for`: the name of
/// the gateway whose write requests are listened for; empty: none are. The error says what in
/// `dds:` to change.
Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const ParticipantOptions& options,
                                                       const Room& room,
                                                       const std::string& requests_for = {});
/// For all points and devices of `store`, as `config.dds` has it.
Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const config::Config& config,
                                                       const bus::PointStore& store);

}  // namespace baudgate::dds
