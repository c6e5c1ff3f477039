// What a person may send by hand: the check value in the place of XX, and which telegrams are reads
// for certain: `$AAM` and `$AA2`. Any other is a write on some module, or in the other checksum
// mode.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

extern const TelegramRule kTelegram;

}  // namespace baudgate::protocols::dcon
