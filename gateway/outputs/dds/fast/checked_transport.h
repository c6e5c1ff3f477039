// A transport of Fast DDS that hands on only what gateway/outputs/dds/fast/datagram_check.h lets
// in. What is sent goes through untouched, one datagram at a time. Decides at which address a
// participant of this machine is reached.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <memory>
#include <mutex>

#include "gateway/outputs/dds/fast/datagram_check.h"

namespace baudgate::dds {

struct CheckedTransportDescriptor : eprosima::fastdds::rtps::ChainingTransportDescriptor {
  /// `below` is complete: its limits are taken over here.
  CheckedTransportDescriptor(
      std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> below,
      std::shared_ptr<DatagramGate> gate_of_all);

  eprosima::fastdds::rtps::TransportInterface* create_transport() const override;

  std::shared_ptr<DatagramGate> gate;
};

class CheckedTransport : public eprosima::fastdds::rtps::ChainingTransport {
 public:
  explicit CheckedTransport(const CheckedTransportDescriptor& descriptor);

  eprosima::fastdds::rtps::TransportDescriptorInterface* get_configuration() override;

  bool send(eprosima::fastrtps::rtps::SenderResource* below,
            const eprosima::fastrtps::rtps::octet* bytes, std::uint32_t size,
            eprosima::fastrtps::rtps::LocatorsIterator* to,
            eprosima::fastrtps::rtps::LocatorsIterator* to_end,
            const std::chrono::steady_clock::time_point& timeout) override;

  void receive(eprosima::fastdds::rtps::TransportReceiverInterface* next,
               const eprosima::fastrtps::rtps::octet* bytes, std::uint32_t size,
               const eprosima::fastrtps::rtps::Locator_t& local,
               const eprosima::fastrtps::rtps::Locator_t& remote) override;

  /// The address at which `announced` is reached. Fast DDS 2.9 itself ignores an address of this
  /// machine that it does not use, and takes loopback for all others, although there may be no
  /// listener there. False: it cannot be reached.
  bool transform_remote_locator(const eprosima::fastrtps::rtps::Locator_t& announced,
                                eprosima::fastrtps::rtps::Locator_t& reached) const override;

 private:
  CheckedTransportDescriptor descriptor_;
  std::mutex sending_;
};

}  // namespace baudgate::dds
