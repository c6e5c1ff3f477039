// How the check value of a telegram may be computed that is wrong as it is described. Pure; used by
// protocols/telegram/recognise.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "protocols/protocol.h"
#include "protocols/telegram/matching.h"

namespace baudgate::protocols::telegram {

/// `match`: all but its check value is right. Empty: what stands there is no check value.
std::optional<Recognised> OtherChecksum(const Form& form, const Match& match);

}  // namespace baudgate::protocols::telegram
