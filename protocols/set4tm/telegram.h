// What a person may send by hand: the check value behind bytes that have none, and which telegrams
// are reads for certain. Opening the channel is none: it carries the password.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate::protocols::set4tm {

extern const TelegramRule kTelegram;

}  // namespace baudgate::protocols::set4tm
