// Messages of another protocol: binary ones on a line of a text protocol, as their check value
// proves, and texts on any line, as their form proves.
// Pure; used by gateway/diagnosis/damage/examine.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate {

/// Empty: none is recognised.
std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

}  // namespace baudgate
