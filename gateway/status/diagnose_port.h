// Sentences about the port of a line or its connection: closed, lost, or ended by the server. Pure;
// used by gateway/status/diagnose.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gateway/store/line_status.h"
#include "gateway/store/point_store.h"

namespace baudgate::control {

/// Why a port that is not open is not.
std::string SayClosed(const config::Line& line, const LineStatus& status,
                      std::span<const DeviceRecord> devices, Now now);

/// An open port: it was lost, or the server ended its connection, so often that it is no chance.
std::vector<std::string> AboutLosses(const config::Line& line, const LineStatus& status,
                                     std::span<const DeviceRecord> devices, Now now);

/// A server that ends the connection behind each answer, where that costs polls. Empty: it is not
/// so.
std::string SayEndsEach(const LineStatus& status, std::span<const DeviceRecord> devices, Now now);

}  // namespace baudgate::control
