// Messages of another protocol on a line of a text protocol, as their check value proves.
// Pure; used by gateway/line/examine.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/line/examine.h"

namespace baudgate {

/// Empty: there is none, or the protocol of the line is not a text protocol.
std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

}  // namespace baudgate
