// DDS Security for a participant: Fast DDS's own plugins (PKI-DH, Access-Permissions,
// AES-GCM-GMAC), given their files as properties. For gateway/outputs/dds/fast/participant.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/dds_security.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/secured_check.h"

namespace eprosima::fastrtps::rtps {
class PropertyPolicy;
}

namespace baudgate::dds {

/// Adds what the library needs, and says what to demand of datagrams. The error names the file that
/// is wrong: without one of them there is no participant.
Result<Secured> AddSecurity(const config::DdsSecurity& security, WallTime now,
                            eprosima::fastrtps::rtps::PropertyPolicy& properties);

}  // namespace baudgate::dds
