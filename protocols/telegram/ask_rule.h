// What `baudgate ask` needs to know of telegrams that a person sends.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate::protocols::telegram {

extern const TelegramRule kAskRule;

}  // namespace baudgate::protocols::telegram
