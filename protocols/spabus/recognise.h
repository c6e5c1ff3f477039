// What bytes are that came in place of a SPA reply: another slave, another master.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/protocol.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::spabus
