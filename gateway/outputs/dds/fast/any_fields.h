// A sample whose type is known only since it was discovered, as names and texts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastrtps/types/DynamicData.h>

#include <vector>

#include "gateway/outputs/dds/fast/any_subscriber.h"

namespace baudgate::dds {

/// What is beyond 1,000 fields, or nested more than 16 deep, is left out.
std::vector<AnyField> FieldsOf(eprosima::fastrtps::types::DynamicData& sample,
                               const eprosima::fastrtps::types::DynamicType_ptr& type);

}  // namespace baudgate::dds
