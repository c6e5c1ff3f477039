// `NewPointType` and its siblings create the Fast DDS type supports, which convert between Fast DDS
// payloads and the samples of gateway/outputs/dds/published_types.h. HashKey computes key hashes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/common/Time_t.h>

#include <array>
#include <cstdint>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {

inline eprosima::fastrtps::Duration_t DdsTime(Duration duration) {
  return {static_cast<std::int32_t>(duration / 1s),
          static_cast<std::uint32_t>((duration % 1s) / 1ns)};
}

/// The key hash of a sample, as every DDS vendor computes it from gateway/outputs/dds/baudgate.idl
/// (RTPS 9.6.3.8): the MD5 of the key fields in big-endian CDR, because the key can be longer than
/// 16 bytes.
using KeyHash = std::array<std::uint8_t, 16>;
/// HashKey is instantiated for all samples of gateway/outputs/dds/published_types.h.
template <typename Sample>
KeyHash HashKey(const Sample& sample);

}  // namespace baudgate::dds

namespace eprosima::fastdds::dds {
class TopicDataType;
}

namespace baudgate::dds {

/// Return the type supports of baudgate::v1::PointSample, DeviceStatus, GatewayStatus, DeviceEvent,
/// AlarmState, WriteRequest and WriteReply. The caller passes the result to a Fast DDS TypeSupport,
/// which owns it. Fast DDS passes a sample as a pointer to its struct (PointSample, DeviceSample
/// …).
eprosima::fastdds::dds::TopicDataType* NewPointType();
eprosima::fastdds::dds::TopicDataType* NewDeviceType();
eprosima::fastdds::dds::TopicDataType* NewGatewayType();
eprosima::fastdds::dds::TopicDataType* NewEventType();
eprosima::fastdds::dds::TopicDataType* NewAlarmType();
eprosima::fastdds::dds::TopicDataType* NewRequestType();
eprosima::fastdds::dds::TopicDataType* NewReplyType();

}  // namespace baudgate::dds
