// Telegrams that a person sends: `baudgate ask`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/protocol.h"

namespace baudgate::protocols::telegram {

extern const TelegramRule kManualTelegrams;

}  // namespace baudgate::protocols::telegram
