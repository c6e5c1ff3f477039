// `RawWriter` publishes any bytes under the name of a type, as a foreign program could.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/bytes.h"

namespace eprosima::fastdds::dds {
class DataWriter;
class DomainParticipant;
}  // namespace eprosima::fastdds::dds

namespace baudgate::dds::testing {

class RawWriter {
 public:
  RawWriter(const std::string& topic, const std::string& type);
  ~RawWriter();
  RawWriter(const RawWriter&) = delete;
  RawWriter& operator=(const RawWriter&) = delete;

  bool Write(const Bytes& payload);  ///< the payload begins with the encapsulation header
  std::string guid() const;          ///< in the text form of Fast DDS

 private:
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

}  // namespace baudgate::dds::testing
