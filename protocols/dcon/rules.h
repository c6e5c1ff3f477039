// What may answer a DCON request, from the request's bytes and the device's options alone.
// RequestRule and ReplyRule say where messages begin and end, and Recognise what other bytes are;
// the tables for a scan and for telegrams by hand stand here too.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "protocols/dcon/settings.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"

namespace baudgate::protocols::dcon {

/// An empty request: what a twin listens for.
Expectation Expect(View request, const Settings& settings);

// Where DCON messages begin and end in the bytes that protocols/assembler.h holds.

/// Requests: from one of $ # % @ ~ ^ to CR.
Cut RequestRule(View held, const Expectation& expect, bool idle);

/// Replies: from one of > ! ? to CR.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

// What a scan asks on a bus that may be one of DCON modules: `$AAM` and `$AA2`, with and without a
// checksum, the only two commands that no module takes for a write in either mode. Nothing else.
// Modules that know neither (OWEN's) are not found. Goes to gateway/tools/scan through the
// descriptor.

extern const ScanRule kScan;

// What a person may send by hand: the check value in the place of XX, and which telegrams are reads
// for certain: `$AAM` and `$AA2`. Any other is a write on some module, or in the other checksum
// mode.

extern const TelegramRule kTelegram;

// What bytes are that came in place of a DCON reply: a checksum that is set otherwise, another
// module, another master.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

/// See ForeignRule: a request to read, "#01" and a carriage return.
std::optional<std::string> ForeignDcon(View heard);

}  // namespace baudgate::protocols::dcon
