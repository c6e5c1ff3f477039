// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/checked_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastrtps/utils/IPLocator.h>

#include <utility>

namespace baudgate::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::LocatorsIterator;
using eprosima::fastrtps::rtps::octet;
using eprosima::fastrtps::rtps::SenderResource;

/// An IPv4 address stands in the last four bytes.
Sender SenderOf(const Locator_t& remote) {
  Sender sender;
  for (std::size_t i = 12; i < 16; ++i) sender.address = sender.address << 8 | remote.address[i];
  sender.port = static_cast<std::uint16_t>(remote.port);
  return sender;
}

}  // namespace

CheckedTransportDescriptor::CheckedTransportDescriptor(
    std::shared_ptr<rtps::TransportDescriptorInterface> below,
    std::shared_ptr<DatagramGate> gate_of_all)
    : ChainingTransportDescriptor(std::move(below)), gate(std::move(gate_of_all)) {}

rtps::TransportInterface* CheckedTransportDescriptor::create_transport() const {
  return new CheckedTransport(*this);
}

CheckedTransport::CheckedTransport(const CheckedTransportDescriptor& descriptor)
    : ChainingTransport(descriptor), descriptor_(descriptor) {}

rtps::TransportDescriptorInterface* CheckedTransport::get_configuration() { return &descriptor_; }

bool CheckedTransport::send(SenderResource* below, const octet* bytes, std::uint32_t size,
                            LocatorsIterator* to, LocatorsIterator* to_end,
                            const std::chrono::steady_clock::time_point& timeout) {
  // The transport below counts datagrams by address, which two threads at once end in an assertion.
  const std::lock_guard lock(sending_);
  return below->send(bytes, size, to, to_end, timeout);
}

void CheckedTransport::receive(rtps::TransportReceiverInterface* next, const octet* bytes,
                               std::uint32_t size, const Locator_t& local,
                               const Locator_t& remote) {
  // The buffer is the receiving thread's own; the library writes into it as well.
  const std::span datagram(const_cast<octet*>(bytes), size);
  const auto passed =
      descriptor_.gate->LetIn(datagram, SenderOf(remote), std::chrono::steady_clock::now());
  if (passed.empty()) return;
  next->OnDataReceived(passed.data(), static_cast<std::uint32_t>(passed.size()), local, remote);
}

bool CheckedTransport::transform_remote_locator(const Locator_t& announced,
                                                Locator_t& reached) const {
  if (!IsLocatorSupported(announced)) return false;
  reached = announced;
  if (!is_local_locator(announced) || is_locator_allowed(announced)) return true;
  // We have no socket at this address of this machine, so we have heard its owner on loopback.
  IPLocator::setIPv4(reached, "127.0.0.1");
  return is_locator_allowed(reached);
}

}  // namespace baudgate::dds
