// What a person may send by hand: the check value in the place of XX, and which telegrams are reads
// for certain. `L` is none: it takes the events out of the relay.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate::protocols::spabus {

extern const TelegramRule kTelegram;

}  // namespace baudgate::protocols::spabus
