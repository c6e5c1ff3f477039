// `SendPacket` and others use the local SOCK_SEQPACKET socket of the link. Each packet is one
// message. No function blocks. The kernel's buffer holds 208 KiB, about 200 samples.
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

/// One byte longer than the longest message, so that ParseLink refuses a packet that is too long.
using PacketBuffer = std::array<std::uint8_t, kMaxLinkMessage + 1>;
enum class PacketGot : std::uint8_t { packet, nothing_yet, closed };
struct ReceivedPacket {
  PacketGot got = PacketGot::closed;
  View packet;  ///< part of the buffer
};
ReceivedPacket ReceivePacket(int socket, PacketBuffer& buffer);

/// Returns both sockets of a connected pair. All descriptors made here are non-blocking and closed
/// at exec.
Result<std::pair<Descriptor, Descriptor>> MakePacketPair();
/// Returns a listening socket at `path`, and replaces a socket file to which it cannot connect. The
/// owner of the file and the members of `group` can connect; if there is no such group, the members
/// of the process's group.
Result<Descriptor> ListenAt(const std::string& path, const std::string& group);
Result<Descriptor> ConnectTo(const std::string& path);

struct Peer {
  Descriptor socket;
  int process = 0;
  unsigned user = 0;
};
/// Returns the next client; empty: no client is waiting.
std::optional<Peer> AcceptPeer(int listener);

}  // namespace baudgate::dds
