// The local socket that carries the link: SOCK_SEQPACKET, so that each packet is one message. Never
// blocks; what it can hold is bounded by the kernel's buffer (208 KiB, some 200 samples).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/outputs/dds/link/link_message.h"

namespace baudgate::dds {

/// A file descriptor that is closed with its owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { Close(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    Close();
    number_ = std::exchange(other.number_, -1);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int get() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }
  void Close();

 private:
  int number_ = -1;
};

enum class PacketSent : std::uint8_t { yes, full, closed };
PacketSent SendPacket(int socket, View packet);

/// A packet longer than any message shows as one byte more than the longest, which ParseLink
/// refuses.
using PacketBuffer = std::array<std::uint8_t, kMaxLinkMessage + 1>;
enum class PacketGot : std::uint8_t { packet, nothing_yet, closed };
struct ReceivedPacket {
  PacketGot got = PacketGot::closed;
  View packet;  ///< in the buffer
};
ReceivedPacket ReceivePacket(int socket, PacketBuffer& buffer);

/// Both ends; all descriptors made here are non-blocking and closed at exec.
Result<std::pair<Descriptor, Descriptor>> MakePacketPair();
/// Replaces a socket file without a server. It may be opened by its owner and by members of
/// `group` (or of our own group, when there is no such group).
Result<Descriptor> ListenAt(const std::string& path, const std::string& group);
Result<Descriptor> ConnectTo(const std::string& path);

struct Peer {
  Descriptor socket;
  int process = 0;
  unsigned user = 0;
};
/// Empty: no peer has come.
std::optional<Peer> AcceptPeer(int listener);

}  // namespace baudgate::dds
