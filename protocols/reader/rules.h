// What a reader may say, as the frame rule wants it. RequestRule and MessageRule say where messages
// begin and end, and Recognise what a message is that cannot be read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

Expectation Expect(View request, const Settings& settings);

// Where the messages of readers begin and end.

/// Nobody asks a reader: a line of text, for twins that hear one anyway.
Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut MessageRule(View held, const Expectation& expect, bool idle);

// What a message is that cannot be read: other line ends, texts in place of tags, another start,
// end or length than the options say.

/// `request` is empty where nothing was asked.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::reader
