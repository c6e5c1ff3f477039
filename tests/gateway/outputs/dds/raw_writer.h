// A writer of samples as bytes, right or wrong, under the name of any type: what a stranger can
// publish.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/bytes.h"

namespace eprosima::fastdds::dds {
class DataWriter;
class DomainParticipant;
}  // namespace eprosima::fastdds::dds

namespace baudgate::dds::testing {

/// In a participant of its own; each sample is an instance of its own.
class RawWriter {
 public:
  RawWriter(const std::string& topic, const std::string& type);
  ~RawWriter();
  RawWriter(const RawWriter&) = delete;
  RawWriter& operator=(const RawWriter&) = delete;

  bool Write(const Bytes& payload);  ///< with its encapsulation
  std::string guid() const;          ///< as Fast DDS writes it

 private:
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

}  // namespace baudgate::dds::testing
