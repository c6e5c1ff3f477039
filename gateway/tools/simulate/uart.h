// What a UART makes of characters that another one has sent with other settings: the bits of the
// wire, sampled at the receiver's own rate and read in its own format. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/serial.h"
#include "gateway/base/bytes.h"

namespace baudgate {

struct Received {
  Bytes bytes;              ///< a damaged character is 0, as a tty hands it over
  std::size_t damaged = 0;  ///< characters with a wrong parity or stop bit
};

/// `sent`: characters without a pause between them, on a wire that is idle before and after.
Received ReceiveAs(const config::SerialSettings& receiver, View sent,
                   const config::SerialSettings& sender);

/// Whether every character arrives as it was sent.
bool Understand(const config::SerialSettings& a, const config::SerialSettings& b);

}  // namespace baudgate
