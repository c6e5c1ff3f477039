// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/discovery/announcement_relay.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"

namespace baudgate::dds {
namespace {

// Number of times that the announcement of a new or changed participant is forwarded without the
// pause RelayLimits::repeat, because datagrams can be lost.
constexpr int kFirstRounds = 3;
constexpr std::size_t kMostAddresses = 1024;

}  // namespace

AnnouncementRelay::AnnouncementRelay(const RelayLimits& limits)
    : limits_(limits), sent_{limits.to_all.burst, {}} {
  known_.reserve(limits.participants);
}

Relayed AnnouncementRelay::On(View datagram, UdpAddress sender, Instant now) {
  introductions_.clear();
  if (datagram.size() > limits_.datagram) return {{}, "an announcement that is too long"};
  auto announcement = ReadAnnouncement(datagram, sender);
  if (!announcement) return {{}, announcement.error()};
  // A message that says a participant leaves is ignored, because anybody can forge it. The
  // participant is removed when its lease ends.
  if (announcement->leaves) return {};
  ForgetSilent(now);
  Known* one = Find(announcement->participant);
  if (one == nullptr) {
    if (std::string refused = Admit(std::move(*announcement), sender, now); !refused.empty()) {
      return {{}, std::move(refused)};
    }
    one = &known_.back();
    IntroduceOthersTo(*one, now);
  } else {
    // A machine with two networks announces itself from two addresses; only the first address is
    // used.
    if (one->announcement.at.address != sender.address) return {};
    one->heard = now;
    if (!std::ranges::equal(one->announcement.said(), announcement->said())) one->rounds = 0;
    one->announcement = std::move(*announcement);
  }
  if (IsDue(*one, now) && one->purse.Take(limits_.rounds_of_participant, now)) {
    IntroduceToOthers(*one, now);
  }
  return {introductions_, {}};
}

void AnnouncementRelay::ForgetSilent(Instant now) {
  std::erase_if(known_, [&](const Known& one) {
    return now - one.heard > std::min(one.announcement.lease, limits_.longest_lease);
  });
}

AnnouncementRelay::Known* AnnouncementRelay::Find(const GuidPrefix& participant) {
  const auto at = std::ranges::find(known_, participant,
                                    [](const Known& one) { return one.announcement.participant; });
  return at == known_.end() ? nullptr : &*at;
}

std::string AnnouncementRelay::Admit(Announcement announcement, UdpAddress sender, Instant now) {
  if (known_.size() >= limits_.participants) return std::string(Words(Refusal::participants));
  const auto of_address = std::ranges::count(
      known_, sender.address, [](const Known& one) { return one.announcement.at.address; });
  if (static_cast<std::size_t>(of_address) >= limits_.of_address ||
      !AddressOf(sender.address, now).newcomers.Take(limits_.new_of_address, now)) {
    return std::string(Words(Refusal::address));
  }
  known_.push_back(
      {std::move(announcement), now, 0, {}, Purse{limits_.rounds_of_participant.burst, now}});
  return {};
}

bool AnnouncementRelay::IsDue(const Known& one, Instant now) const {
  const Duration repeat =
      std::max(limits_.repeat, limits_.repeat_each * static_cast<std::int64_t>(known_.size()));
  return one.rounds < kFirstRounds || now - one.last_round >= repeat;
}

void AnnouncementRelay::IntroduceOthersTo(const Known& newcomer, Instant now) {
  for (const Known& other : known_) Introduce(other, newcomer, now);
}

void AnnouncementRelay::IntroduceToOthers(Known& one, Instant now) {
  one.rounds = std::min(one.rounds + 1, kFirstRounds);
  one.last_round = now;
  for (const Known& other : known_) Introduce(one, other, now);
}

/// Queues the announcement of `whom` for `to`. If a rate is exceeded, nothing is sent now; the next
/// repetition sends the announcement.
void AnnouncementRelay::Introduce(const Known& whom, const Known& to, Instant now) {
  if (&whom == &to || whom.announcement.domain != to.announcement.domain) return;
  const Role role = whom.announcement.role;
  if (role != Role::any && role == to.announcement.role) return;
  const UdpAddress& at = to.announcement.at;
  if (!AddressOf(at.address, now).sent.Take(limits_.to_address, now)) return;
  if (!sent_.Take(limits_.to_all, now)) return;
  introductions_.push_back({at, whom.announcement.datagram});
}

AnnouncementRelay::Address& AnnouncementRelay::AddressOf(std::uint32_t address, Instant now) {
  auto at = std::ranges::find(addresses_, address, &Address::address);
  if (at == addresses_.end()) {
    if (addresses_.size() < kMostAddresses) {
      at = addresses_.insert(addresses_.end(), Address{});
    } else {
      at = std::ranges::min_element(addresses_, {}, &Address::used);
    }
    *at = {address, {limits_.new_of_address.burst, now}, {limits_.to_address.burst, now}, now};
  }
  at->used = now;
  return *at;
}

bool AnnouncementRelay::Purse::Take(const RelayRate& rate, Instant now) {
  // `filled` advances by the time of whole datagrams only; the rest of the time counts at the next
  // call.
  const Duration each = Duration(1s) / rate.each_second;
  const std::int64_t earned = std::clamp<std::int64_t>((now - filled) / each, 0, rate.burst);
  if (earned > 0) {
    left = std::min(rate.burst, left + earned);
    filled = earned == rate.burst ? now : filled + earned * each;
  }
  if (left == 0) return false;
  --left;
  return true;
}

namespace {

constexpr int kMostAtOnce = 256;
// Buffer size in bytes: the announcements of 512 participants fit at once.
constexpr int kSocketBuffer = 4 << 20;

sockaddr_in AddressOf(const UdpAddress& at) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(at.port);
  address.sin_addr.s_addr = htonl(at.address);
  return address;
}

Error CanNotOpen(const config::HostPort& at, int reason) {
  std::string text =
      at.host + ":" + std::to_string(at.port) + " cannot be opened: " + std::strerror(reason);
  if (reason == EADDRINUSE) text += "; does another discovery server run on this machine?";
  if (reason == EADDRNOTAVAIL)
    text += "; choose an address of this machine, which ip -4 addr lists";
  return Error{text};
}

}  // namespace

Result<RelaySocket> RelaySocket::Open(const config::HostPort& at) {
  const auto place = ParseUdpAddress(at.host, at.port);
  if (!place) return CanNotOpen(at, EINVAL);
  RelaySocket opened(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (opened.descriptor_ < 0) return CanNotOpen(at, errno);
  ::setsockopt(opened.descriptor_, SOL_SOCKET, SO_RCVBUF, &kSocketBuffer, sizeof kSocketBuffer);
  ::setsockopt(opened.descriptor_, SOL_SOCKET, SO_SNDBUF, &kSocketBuffer, sizeof kSocketBuffer);
  const sockaddr_in address = AddressOf(*place);
  if (::bind(opened.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
      0) {
    return CanNotOpen(at, errno);
  }
  return opened;
}

RelaySocket::~RelaySocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

RelaySocket::RelaySocket(RelaySocket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

void RelaySocket::Take(AnnouncementRelay& relay) {
  std::array<std::uint8_t, 0x10000> buffer;
  for (int i = 0; i < kMostAtOnce; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = ::recvfrom(descriptor_, buffer.data(), buffer.size(), 0,
                                    reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) return;
    const UdpAddress sender{ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
    const Relayed relayed =
        relay.On(View(buffer.data(), static_cast<std::size_t>(size)), sender, ReadClocks().instant);
    if (!relayed.refused.empty()) {
      log::WarnFolded("discovery server: refused", "discovery server: refused {} from {}",
                      relayed.refused, Text(sender));
    }
    for (const Introduction& introduction : relayed.introductions) Send(introduction);
  }
}

void RelaySocket::Send(const Introduction& introduction) const {
  const sockaddr_in to = AddressOf(introduction.to);
  // If the datagram cannot be sent now, the announcement is sent again at the next repetition.
  [[maybe_unused]] const auto sent =
      ::sendto(descriptor_, introduction.datagram.data(), introduction.datagram.size(),
               MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

}  // namespace baudgate::dds
