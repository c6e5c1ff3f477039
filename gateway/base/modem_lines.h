// The lines of a serial port beside its data.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

struct ModemLines {
  bool dtr = false;  ///< set by this machine, as `rts`
  bool rts = false;
  bool cts = false;  ///< set by the device, as all below
  bool dsr = false;
  bool dcd = false;
  bool ring = false;

  bool operator==(const ModemLines&) const = default;
};

}  // namespace baudgate
