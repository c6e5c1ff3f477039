// Replies as the makers' manuals print them, for `baudgate decode`: what an exchange says when no
// point of the device reads its command. Polling never asks this file, because there a reply has
// the one form that its point names. Requests and replies come from codec.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"

namespace baudgate::protocols::dcon {

/// The values with their labels; nothing when no manual prints such a reply to `request`. Where
/// makers disagree, every printed form is taken and the label says which one it is.
std::optional<Answer> ReadPrinted(const Command& request, View frame, const Settings& settings);

}  // namespace baudgate::protocols::dcon
