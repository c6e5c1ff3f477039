// What bytes are that came in place of a reply of a meter: another check value, another meter.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/protocol.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::set4tm
