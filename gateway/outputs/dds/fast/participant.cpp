// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/participant.h"

#include <fastdds/rtps/attributes/PropertyPolicy.h>
#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <iterator>
#include <memory>
#include <mutex>

#include "gateway/outputs/dds/fast/own_network.h"
#include "gateway/outputs/dds/fast/types.h"
#include "gateway/outputs/pki/security_check.h"

namespace baudgate::dds {
namespace {

using eprosima::fastrtps::rtps::BuiltinAttributes;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;

constexpr char kMulticastGroup[] = "239.255.0.1";  // RTPS 2.3, 9.6.1.4
/// The number of ports at each peer to which announcements are sent. A participant takes the lowest
/// free port of its machine, so participants beyond this number on one machine are not found
/// through `peers`.
constexpr std::uint32_t kParticipantsOfPeer = 32;

/// Returns the locator of a UDP port. Port 0 stands for the ports of the domain.
Locator_t LocatorOf(const std::string& address, std::uint16_t port = 0) {
  Locator_t locator;
  IPLocator::createLocator(LOCATOR_KIND_UDPv4, address, port, locator);
  return locator;
}

/// Restricts the participant to unicast: if metatrafficUnicastLocatorList contains addresses, the
/// library does not add the multicast group.
void HearUnicastOnly(const ParticipantOptions& options, BuiltinAttributes& builtin) {
  for (const std::string& address : options.interfaces) {
    builtin.metatrafficUnicastLocatorList.push_back(LocatorOf(address));
  }
  if (options.interfaces.empty()) {
    builtin.metatrafficUnicastLocatorList.push_back(LocatorOf("0.0.0.0"));
  }
}

/// Sets the hosts to which announcements are sent besides the multicast group, or instead of it.
/// Fast DDS treats a discovery server as a peer with a port.
void AskPeers(const ParticipantOptions& options,
              eprosima::fastdds::dds::DomainParticipantQos& qos) {
  auto& builtin = qos.wire_protocol().builtin;
  if (!options.multicast) HearUnicastOnly(options, builtin);
  if (options.peers.empty() && options.discovery_servers.empty() && options.reached.empty()) return;
  auto& asked = builtin.initialPeersList;
  // Configured peers replace the library's default, the multicast group, so the group must be
  // added.
  if (options.multicast) asked.push_back(LocatorOf(kMulticastGroup));
  for (const std::string& peer : options.peers) asked.push_back(LocatorOf(peer));
  for (const auto* places : {&options.discovery_servers, &options.reached}) {
    for (const auto& at : *places) asked.push_back(LocatorOf(at.host, at.port));
  }
}

/// Adds the properties of DDS Security for the library, and returns how datagrams must be secured.
/// The error contains the faulty file, with which the library could not create a participant.
Result<Secured> AddSecurity(const config::DdsSecurity& security, WallTime now,
                            eprosima::fastrtps::rtps::PropertyPolicy& properties) {
  if (!security.on()) return Secured::off;
  const pki::SecurityReport report = pki::CheckSecurity(security, now);
  if (const std::string error = report.FirstError(); !error.empty()) {
    return Error{"dds: security: " + error};
  }
  const auto add = [&properties](const std::string& name, const std::string& value) {
    properties.properties().emplace_back("dds.sec." + name, value);
  };
  const auto file = [](const std::string& path) { return "file://" + path; };
  add("auth.plugin", "builtin.PKI-DH");
  add("auth.builtin.PKI-DH.identity_ca", file(security.ca));
  add("auth.builtin.PKI-DH.identity_certificate", file(security.identity));
  add("auth.builtin.PKI-DH.private_key", file(security.key));
  if (!report.password.empty()) add("auth.builtin.PKI-DH.password", report.password);
  add("access.plugin", "builtin.Access-Permissions");
  add("access.builtin.Access-Permissions.permissions_ca", file(security.signer()));
  add("access.builtin.Access-Permissions.governance", file(security.governance));
  add("access.builtin.Access-Permissions.permissions", file(security.permissions));
  add("crypto.plugin", "builtin.AES-GCM-GMAC");
  return report.messages_protected ? Secured::demanded : Secured::allowed;
}

constexpr char kLoopback[] = "127.0.0.1";

/// A participant on this machine is reached at loopback or at `host`. Returns those of the two that
/// `interfaces` lacks.
std::string Missing(const std::string& host, const std::vector<std::string>& interfaces) {
  const auto lacks = [&](const std::string& address) {
    return !MeansAll(interfaces) && std::ranges::find(interfaces, address) == interfaces.end();
  };
  std::string missing;
  if (lacks(kLoopback)) missing = kLoopback;
  if (host != kLoopback && lacks(host)) missing += (missing.empty() ? "" : " and ") + host;
  return missing;
}

std::string Cure(const std::string& host, bool on_this_machine,
                 const std::vector<std::string>& interfaces) {
  if (!on_this_machine) {
    return "add the address of this machine in the network of that host to dds.interfaces";
  }
  const std::string missing = Missing(host, interfaces);
  if (!missing.empty()) {
    return "the participant is on this machine, so add " + missing + " to dds.interfaces";
  }
  return "the participant is on this machine and must use an address of dds.interfaces beside "
         "127.0.0.1";
}

}  // namespace

std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces) {
  return host +
         " was discovered but cannot be answered: " + Cure(host, on_this_machine, interfaces);
}

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::LocatorsIterator;
using eprosima::fastrtps::rtps::octet;
using eprosima::fastrtps::rtps::SenderResource;

/// Returns address and port of a locator, whose last four bytes are the IPv4 address.
Sender SenderOf(const Locator_t& remote) {
  Sender sender;
  for (std::size_t i = 12; i < 16; ++i) sender.address = sender.address << 8 | remote.address[i];
  sender.port = static_cast<std::uint16_t>(remote.port);
  return sender;
}

struct CheckedTransportDescriptor : rtps::ChainingTransportDescriptor {
  /// `below` must have its final limits, because this constructor copies them.
  CheckedTransportDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> below,
                             std::shared_ptr<DatagramGate> gate_of_all)
      : ChainingTransportDescriptor(std::move(below)), gate(std::move(gate_of_all)) {}

  rtps::TransportInterface* create_transport() const override;

  std::shared_ptr<DatagramGate> gate;
};

/// A transport of Fast DDS that passes received datagrams to the library only if the gate accepts
/// them. It sends datagrams unchanged. It also chooses the address at which a participant of this
/// machine is reached.
class CheckedTransport : public rtps::ChainingTransport {
 public:
  explicit CheckedTransport(const CheckedTransportDescriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor) {}

  rtps::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool send(SenderResource* below, const octet* bytes, std::uint32_t size, LocatorsIterator* to,
            LocatorsIterator* to_end,
            const std::chrono::steady_clock::time_point& timeout) override {
    // The transport below counts datagrams by address, and fails an assertion if two threads send
    // at the same time.
    const std::lock_guard lock(sending_);
    return below->send(bytes, size, to, to_end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* next, const octet* bytes, std::uint32_t size,
               const Locator_t& local, const Locator_t& remote) override {
    // Casting const away is safe: the buffer belongs to the receiving thread, and the library
    // writes into it as well.
    const std::span datagram(const_cast<octet*>(bytes), size);
    const auto passed =
        descriptor_.gate->LetIn(datagram, SenderOf(remote), std::chrono::steady_clock::now());
    if (passed.empty()) return;
    next->OnDataReceived(passed.data(), static_cast<std::uint32_t>(passed.size()), local, remote);
  }

  /// Sets `reached` to the address at which the participant `announced` is reached. False: it is
  /// not reachable. Fast DDS 2.9 would replace every address of this machine that it does not use
  /// by loopback, even if nobody listens there.
  bool transform_remote_locator(const Locator_t& announced, Locator_t& reached) const override {
    if (!IsLocatorSupported(announced)) return false;
    reached = announced;
    if (!is_local_locator(announced) || is_locator_allowed(announced)) return true;
    // We have no socket at this address, so the participant's announcement has come over loopback.
    IPLocator::setIPv4(reached, "127.0.0.1");
    return is_locator_allowed(reached);
  }

 private:
  CheckedTransportDescriptor descriptor_;
  std::mutex sending_;
};

rtps::TransportInterface* CheckedTransportDescriptor::create_transport() const {
  return new CheckedTransport(*this);
}

constexpr int kLastDomain = 232;  // the ports of higher domains would be above 65535
constexpr Duration kAnnouncements = 1300ms;
// The most readers, and the most writers, of one participant that the library stores.
constexpr std::size_t kEndpointsEach = 32;

// Prints the library's messages to standard error, because its default, standard output, contains
// our JSON lines. Repeated messages are folded, because a hostile packet can cause endless
// messages.
class FoldedLog : public fast::LogConsumer {
 public:
  void Consume(const fast::Log::Entry& entry) override {
    const Instant now = std::chrono::steady_clock::now();
    if (now < silent_until_) {
      ++folded_;
      return;
    }
    silent_until_ = now + 10s;
    std::fprintf(stderr, "dds: Fast DDS: %s (%llu earlier lines not shown)\n",
                 entry.message.c_str(), folded_);
    folded_ = 0;
  }

 private:
  Instant silent_until_{};
  unsigned long long folded_ = 0;
};

void PrepareProcessOnce() {
  static std::once_flag once;
  std::call_once(once, [] {
    // Without this variable, the library would silently apply a DEFAULT_FASTRTPS_PROFILES.xml in
    // the working directory.
    ::setenv("SKIP_DEFAULT_XML_FILE", "1", 1);
    // These variables would override the configuration.
    ::unsetenv("FASTRTPS_DEFAULT_PROFILES_FILE");
    ::unsetenv("ROS_DISCOVERY_SERVER");
    fast::Log::ClearConsumers();
    fast::Log::RegisterConsumer(std::make_unique<FoldedLog>());
    fast::Log::SetVerbosity(fast::Log::Kind::Error);
  });
}

Status Check(const ParticipantOptions& options) {
  if (options.domain < 0 || options.domain > kLastDomain) {
    return Error{"dds: domain " + std::to_string(options.domain) + " is not 0..232"};
  }
  return {};
}

/// Returns the configured addresses that this machine has now, because the library reaches nobody
/// if the list contains an address that the machine does not have. Returns an error if no address
/// is left.
Result<std::vector<std::string>> Present(const std::vector<std::string>& interfaces) {
  const OwnAddresses own = FindOwnAddresses();
  std::vector<std::string> present;
  std::ranges::copy_if(interfaces, std::back_inserter(present),
                       [&own](const std::string& address) { return IsOwn(own, address); });
  if (!present.empty()) return present;
  return Error{
      fmt::format("dds: this machine has none of the addresses in dds.interfaces [{}]; ip -4 addr "
                  "lists the addresses of this machine",
                  fmt::join(interfaces, ", "))};
}

std::shared_ptr<DatagramGate> GateOf(const fast::DomainParticipant& participant) {
  for (const auto& transport : participant.get_qos().transport().user_transports) {
    const auto checked = std::dynamic_pointer_cast<CheckedTransportDescriptor>(transport);
    if (checked) return checked->gate;
  }
  return nullptr;
}

std::shared_ptr<DatagramGate> GateFor(const ParticipantOptions& options, Secured security) {
  CheckOptions check;
  check.security = security;
  check.participants.participants = options.participants;
  for (const auto& server : options.discovery_servers) {
    if (const auto at = ParseUdpAddress(server.host, server.port)) check.servers.push_back(*at);
  }
  return std::make_shared<DatagramGate>(
      check, [](const std::string& line) { std::fprintf(stderr, "dds: %s\n", line.c_str()); });
}

Status Settle(const ParticipantOptions& options, fast::DomainParticipantQos& qos) {
  const auto security = AddSecurity(options.security, ReadClocks().wall, qos.properties());
  if (!security) return Error{security.error()};
  qos.name(options.name);
  auto& transport = qos.transport();
  transport.user_transports.clear();
  transport.use_builtin_transports = false;
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  udp->sendBufferSize = udp->receiveBufferSize = kSocketBuffer;
  if (!MeansAll(options.interfaces)) {
    const auto present = Present(options.interfaces);
    if (!present) return Error{present.error()};
    udp->interfaceWhiteList = *present;
  }
  if (!options.peers.empty()) udp->maxInitialPeersRange = kParticipantsOfPeer;
  transport.user_transports.push_back(
      std::make_shared<CheckedTransportDescriptor>(udp, GateFor(options, *security)));
  // The library's own limits apply if the gate lets in too many participants. Our own participant
  // counts.
  auto& places = qos.allocation();
  places.participants.maximum = options.participants + 1;
  places.readers.maximum = places.writers.maximum = kEndpointsEach;
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = DdsTime(options.lease);
  discovery.leaseDuration_announcementperiod = DdsTime(kAnnouncements);
  AskPeers(options, qos);
  return {};
}

}  // namespace

bool MeansAll(const std::vector<std::string>& interfaces) {
  return interfaces.empty() || std::ranges::find(interfaces, "0.0.0.0") != interfaces.end();
}

Result<fast::DomainParticipant*> CreateParticipant(const ParticipantOptions& options,
                                                   fast::DomainParticipantListener* listener,
                                                   Role role) {
  PrepareProcessOnce();
  if (const Status status = Check(options); !status) return Error{status.error()};
  fast::DomainParticipantQos qos;
  if (const Status status = Settle(options, qos); !status) return Error{status.error()};
  const std::string_view text = UserDataOf(role);
  qos.user_data().setValue({text.begin(), text.end()});
  try {
    auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<fast::DomainId_t>(options.domain), qos, listener, fast::StatusMask::none());
    if (participant != nullptr) return participant;
    if (options.security.on()) {
      return Error{"dds: security: cannot create a participant in domain " +
                   std::to_string(options.domain) + "; check that " + options.security.governance +
                   " and " + options.security.permissions +
                   " name this domain, and that the permissions are already valid in local time"};
    }
    return Error{"dds: cannot create a participant in domain " + std::to_string(options.domain) +
                 "; check that UDP ports from " + std::to_string(MulticastPort(options.domain)) +
                 " are free"};
  } catch (const std::exception& failure) {
    return Error{std::string("dds: ") + failure.what()};
  }
}

DatagramCounters DatagramsOf(const fast::DomainParticipant& participant) {
  const auto gate = GateOf(participant);
  return gate ? gate->counters() : DatagramCounters();
}

Neighbours NeighboursOf(const fast::DomainParticipant& participant,
                        const ParticipantOptions& options) {
  Neighbours neighbours;
  const OwnAddresses own = FindOwnAddresses();
  for (const std::string& address : options.interfaces) {
    const auto why = MeansAll(options.interfaces) ? std::nullopt : WhyUnused(own, address);
    if (!why) continue;
    neighbours.remarks.push_back("DDS sends nothing from " + address +
                                 " (dds.interfaces): " + *why);
  }
  const auto gate = GateOf(participant);
  if (!gate) return neighbours;
  const auto known = gate->known(std::chrono::steady_clock::now());
  for (const UdpAddress& at : known.reached) {
    if (neighbours.reached.size() == Neighbours::kMostReached) break;
    neighbours.reached.push_back({HostOf(at), at.port});
  }
  if (options.security.on()) return neighbours;
  for (const UdpAddress& at : known.unanswered) {
    const std::string host = HostOf(at);
    neighbours.remarks.push_back(UnansweredRemark(host, IsOwn(own, host), options.interfaces));
  }
  return neighbours;
}

void DeleteParticipant(fast::DomainParticipant* participant) {
  participant->set_listener(nullptr);
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

}  // namespace baudgate::dds
