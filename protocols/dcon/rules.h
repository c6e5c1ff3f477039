// Recognises DCON messages by their bytes. Expect returns which replies can answer a request,
// RequestRule and ReplyRule find where messages begin and end, and Recognise explains other bytes.
// kScan and kTelegram are the rules for scans and for telegrams typed by hand.
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "protocols/dcon/settings.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/scanning.h"

namespace baudgate::protocols::dcon {

/// Returns which replies can answer `request`. If `request` is empty, returns what requests look
/// like, which a simulated device (twin) needs.
Expectation Expect(View request, const Settings& settings);

/// Cuts requests: from one of $ # % @ ~ ^ to CR.
Cut RequestRule(View held, const Expectation& expect, bool idle);

/// Cuts replies: from one of > ! ? to CR.
Cut ReplyRule(View held, const Expectation& expect, bool idle);

// The requests of a scan: only `$AAM` and `$AA2`, in both checksum modes, because no module takes
// them for a write in either mode. Modules that support neither request (OWEN's) are not found.

extern const ScanRule kScan;

// The rule for telegrams typed by hand. It replaces a final XX by the checksum. Only `$AAM` and
// `$AA2` count as reads: any other command is a write on some module, or in the other checksum
// mode.

extern const TelegramRule kTelegram;

// Explains bytes that came in place of a DCON reply: the checksum is configured differently, or
// another module or another master sent them.

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

/// Describes a read request of a DCON master in `heard`, such as "#01" and CR; see ForeignRule.
std::optional<std::string> ForeignDcon(View heard);

}  // namespace baudgate::protocols::dcon
