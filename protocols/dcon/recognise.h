// What bytes are that came in place of a DCON reply: a checksum that is set otherwise, another
// module, another master.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "protocols/dcon/settings.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

/// See ForeignRule: a request to read, "#01" and a carriage return.
std::optional<std::string> ForeignDcon(View heard);

}  // namespace baudgate::protocols::dcon
