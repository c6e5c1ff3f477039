// Fast DDS type support for the samples: the adapter between Fast DDS payloads and
// gateway/outputs/dds/cdr.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace eprosima::fastdds::dds {
class TopicDataType;
}

namespace baudgate::dds {

/// Named baudgate::v1::PointSample, DeviceStatus, GatewayStatus, DeviceEvent, AlarmState,
/// WriteRequest and WriteReply. The caller gives them to a Fast DDS TypeSupport, which owns them.
/// Samples pass as PointSample*, DeviceSample*, GatewaySample*, EventSample*, AlarmSample*,
/// RequestSample*, ReplySample*.
eprosima::fastdds::dds::TopicDataType* NewPointType();
eprosima::fastdds::dds::TopicDataType* NewDeviceType();
eprosima::fastdds::dds::TopicDataType* NewGatewayType();
eprosima::fastdds::dds::TopicDataType* NewEventType();
eprosima::fastdds::dds::TopicDataType* NewAlarmType();
eprosima::fastdds::dds::TopicDataType* NewRequestType();
eprosima::fastdds::dds::TopicDataType* NewReplyType();

}  // namespace baudgate::dds
