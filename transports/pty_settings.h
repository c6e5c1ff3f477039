// What the program at the far end of a pty has set it to. A pty keeps bit rate, stop bits, PARODD,
// CMSPAR and the input flags; it forgets data bits and PARENB.
//
//   PARODD                  odd parity
//   CMSPAR                  space parity; with PARODD mark parity
//   INPCK without PARODD    even parity: its user checks it
//   PARMRK without INPCK    no parity: its user marks damaged characters and checks no parity
//   none of these           it cannot be told whether there is even parity or none
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/serial.h"
#include "gateway/base/result.h"

namespace baudgate {

/// From now on a reader that sets nothing fits a device with these settings. `fd`: either side.
Status SetPtyFormat(int fd, const config::SerialSettings& serial);

/// What the reader of the pty has set, as far as that can be told; `device` says the rest. Of an
/// `fd` that is no pty: `device`.
config::SerialSettings ReadPtyFormat(int fd, const config::SerialSettings& device);

}  // namespace baudgate
