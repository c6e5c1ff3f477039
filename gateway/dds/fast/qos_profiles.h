// Loads the file of `dds.profiles` and gives what it says to Fast DDS's QoS, before the gateway's
// own settings are made.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/result.h"

namespace eprosima::fastdds::dds {
class DataWriterQos;
class DomainParticipantQos;
class Publisher;
}  // namespace eprosima::fastdds::dds

namespace baudgate::dds {

/// The profile `baudgate`, if there is one. The file's profiles are known to the library from now
/// on, and those of a file before are not. The error names file, line and element.
Status LoadProfiles(const std::string& file, eprosima::fastdds::dds::DomainParticipantQos& qos);

/// The profile of this topic, if the file that was loaded last has one.
void UseProfile(const eprosima::fastdds::dds::Publisher& publisher, const char* topic,
                eprosima::fastdds::dds::DataWriterQos& qos);

}  // namespace baudgate::dds
