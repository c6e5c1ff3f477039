// `Expect` gives the messages that a reader may send. RequestRule and MessageRule are the frame
// rules, and Recognise explains messages that cannot be read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

Expectation Expect(View request, const Settings& settings);

/// Cuts a line of text, for twins, which may get commands.
Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut MessageRule(View held, const Expectation& expect, bool idle);

// Explains bytes that are no valid message: other line ends, texts instead of tags, or another
// start, end or length than configured.

/// `request` is empty if no command was sent.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::reader
