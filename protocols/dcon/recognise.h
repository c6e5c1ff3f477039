// What bytes are that came in place of a DCON reply: a checksum that is set otherwise, another
// module, another master.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "config/model/options.h"
#include "gateway/base/bytes.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

std::optional<Recognised> Recognise(View request, View heard, const config::Options& options);

}  // namespace baudgate::protocols::dcon
