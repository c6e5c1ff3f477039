// Announces the published types in discovery, as XTypes TypeObjects of version 1: what generic
// tools on Fast DDS 2 decode samples with. Never as TypeInformation: Fast DDS 2.9 writes that in a
// form for which Cyclone DDS drops the endpoint.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/outputs/dds/type_fields.h"

namespace baudgate::dds {

/// Before the type is registered with a participant that is to announce it. Once is enough.
void DescribeType(const TypeDescription& type);

}  // namespace baudgate::dds
