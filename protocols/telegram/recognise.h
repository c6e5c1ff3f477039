// What a text that came in place of an answer may be: one without its check value, without its
// sign, with fewer numbers, or of another form. Pure; for `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "protocols/protocol.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// An empty request: `heard` came unasked.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::telegram
