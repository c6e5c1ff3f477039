// Words for people in what came: a login, a menu, a log. Pure; used by
// gateway/diagnosis/damage/examine.h. OtherFrame recognises messages of another protocol, and
// OtherService other services, such as a web server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate {

/// "'login: '", cut where it is long.
std::string Quote(View text);
/// A line of printable characters, whatever is in it.
bool IsLine(const Hearing& hearing, View heard);
/// Its first bytes are those of a reply, or nearly.
bool BeginsLikeReply(const Hearing& hearing, View heard);
/// Empty: these are no words for people. `lines`: a whole line of printable characters counts, too.
std::optional<Finding> Words(const Hearing& hearing, View heard, bool lines = false);
/// Words that end with the question for a user or a password. Messages of any form may stand in
/// front of it.
std::optional<Finding> LoginPrompt(const Hearing& hearing, View heard);

// Messages of another protocol: binary ones on a line of a text protocol, as their check value
// proves, and texts on any line, as their form proves.
// Pure; used by gateway/diagnosis/damage/examine.h.

/// Empty: none is recognised.
std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

// Other services than a line of devices, by what they say over TCP: a web server, SSH, TLS, Telnet,
// IEC 60870-5-104.
// Pure.

/// Empty: no known service. `modbus`: a Modbus TCP server is expected there, not a serial server.
std::optional<Finding> OtherService(View heard, bool modbus);
/// IAC and WILL, WONT, DO or DONT, at the front.
bool IsTelnet(View heard);

}  // namespace baudgate
