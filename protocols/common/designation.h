// Whether a device is of the type that its profile is for, by the name that it gives itself: DCON's
// `$AAM`, the F text of SPA, the identification of Modbus. Names and free texts are loose, as
// clones and variants have their own, so only a name that another profile lists contradicts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/device.h"
#include "protocols/conversation.h"

namespace baudgate {

/// `says`: the name as it came. Reason::none with a text: nobody lists the name, the values are
/// good anyway.
DeviceTrouble JudgeName(const config::Identity& identity, std::string_view says);

}  // namespace baudgate
