// Messages of another protocol on a line of texts: somebody else's, as their check value proves.
// Pure; used by gateway/line/examine.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/line/examine.h"

namespace baudgate {

/// Nothing: there is none, or the protocol of the line is none of texts.
std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

}  // namespace baudgate
