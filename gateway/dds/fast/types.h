// Fast DDS type support for the samples: the adapter between Fast DDS payloads and
// gateway/dds/cdr.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace eprosima::fastdds::dds {
class TopicDataType;
}

namespace baudgate::dds {

/// Named baudgate::v1::PointSample and baudgate::v1::DeviceStatus. The caller gives them to a Fast
/// DDS TypeSupport, which owns them. Samples pass as PointSample* and DeviceSample*.
eprosima::fastdds::dds::TopicDataType* NewPointType();
eprosima::fastdds::dds::TopicDataType* NewDeviceType();

}  // namespace baudgate::dds
