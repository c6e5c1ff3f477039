// Words for people in what came: a login, a menu, a log. Pure; used by
// gateway/diagnosis/damage/examine.h.
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

}  // namespace baudgate
