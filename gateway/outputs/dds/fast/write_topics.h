// `WriteTopics` contains the DDS reader of write requests to one gateway, and the writer of the
// replies. Requests that were published before the reader existed are marked as early
// (WriteArrival).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <string>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/fast/discovery_listener.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

class WriteTopics final : private eprosima::fastdds::dds::DataReaderListener {
 public:
  WriteTopics(std::string gateway, const VolatileWriters& writers)
      : gateway_(std::move(gateway)), writers_(writers) {}

  /// Creates writer and reader. False: the library could not create them. The participant must be
  /// deleted before this object.
  bool Open(eprosima::fastdds::dds::DomainParticipant& participant);

  void OnRequest(SampleWriter::TakeRequest take);
  Sent Write(const ReplySample& reply);
  /// Returns the number of dropped requests. Requests are dropped when the library has no space for
  /// them, and from then on until Renew.
  std::uint64_t dropped() const { return dropped_; }
  /// Replaces the reader if the library had no space for a request. The old reader would deliver
  /// requests too late, so they are dropped until there is a new reader, which gets only new
  /// requests. To be called regularly, by one thread.
  void Renew();

 private:
  void on_data_available(eprosima::fastdds::dds::DataReader* reader) override;
  void on_sample_rejected(eprosima::fastdds::dds::DataReader* reader,
                          const eprosima::fastdds::dds::SampleRejectedStatus& status) override;

  bool OpenWriter();
  bool OpenReader();
  bool TryWrite(const ReplySample& reply);

  const std::string gateway_;
  const VolatileWriters& writers_;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  eprosima::fastdds::dds::Topic* replies_ = nullptr;
  eprosima::fastdds::dds::Topic* requests_ = nullptr;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
  std::atomic<Instant> opened_ = Instant{};  ///< time when `reader_` was created
  std::atomic<bool> full_ = false;
  std::atomic<std::uint64_t> dropped_ = 0;
  Mutex mutex_;
  SampleWriter::TakeRequest take_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::dds
