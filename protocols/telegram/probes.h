// Which telegram a silent device is looked for with.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {

/// The one that tells the device's name; empty: none does.
std::optional<std::size_t> IdentityTelegram(const Description& description);

/// The same, or else one that no point reads, needs no parameters, and is answered with a length
/// that no poll's answer has. Empty: there is none, and polls are the probes.
std::optional<std::size_t> OwnProbe(const Description& description,
                                    const std::vector<std::optional<ReadPlace>>& reads,
                                    const Bound& bound);

}  // namespace baudgate::protocols::telegram
