// What a message is that cannot be read: other line ends, texts in place of tags, another start,
// end or length than the options say.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/protocol.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

/// `request` is empty where nothing was asked.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::reader
