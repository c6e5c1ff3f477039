// `Expect` returns the messages that a reader can send. RequestRule and MessageRule are the frame
// rules, and Recognise explains messages that cannot be read.
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

Expectation Expect(View request, const Settings& settings);

/// Cuts a line of text. Simulated devices use it for the commands that they get.
Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut MessageRule(View held, const Expectation& expect, bool idle);

/// Explains `heard`, bytes that are not a valid message: they have other line ends, are text
/// instead of tags, or have another start, end or length than configured. `request`: the command in
/// front of them; empty: no command was sent.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::reader
