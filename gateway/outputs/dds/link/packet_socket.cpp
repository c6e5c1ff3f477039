// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/packet_socket.h"

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace baudgate::dds {
namespace {

constexpr int kType = SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC;
constexpr mode_t kMode = 0660;

Error Failed(const std::string& what) { return Error{what + ": " + std::strerror(errno)}; }

std::optional<sockaddr_un> AddressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return std::nullopt;
  path.copy(address.sun_path, path.size());
  return address;
}

Error TooLong(const std::string& path) {
  return Error{path + ": not 1 to " + std::to_string(sizeof sockaddr_un{}.sun_path - 1) +
               " bytes, as the path of a socket must be"};
}

const sockaddr* Plain(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

}  // namespace

void Descriptor::Close() {
  if (number_ >= 0) ::close(std::exchange(number_, -1));
}

PacketSent SendPacket(int socket, View packet) {
  for (;;) {
    if (::send(socket, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) {
      return PacketSent::yes;
    }
    if (errno == EINTR) continue;
    const bool full = errno == EAGAIN || errno == ENOBUFS || errno == ENOMEM;
    return full ? PacketSent::full : PacketSent::closed;
  }
}

ReceivedPacket ReceivePacket(int socket, PacketBuffer& buffer) {
  for (;;) {
    const ssize_t count = ::recv(socket, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count > 0) {
      return {PacketGot::packet, View(buffer).first(static_cast<std::size_t>(count))};
    }
    if (count < 0 && errno == EINTR) continue;
    const bool nothing = count < 0 && errno == EAGAIN;
    return {nothing ? PacketGot::nothing_yet : PacketGot::closed, {}};
  }
}

Result<std::pair<Descriptor, Descriptor>> MakePacketPair() {
  int ends[2];
  if (::socketpair(AF_UNIX, kType, 0, ends) != 0) return Failed("a pair of sockets");
  return std::pair{Descriptor(ends[0]), Descriptor(ends[1])};
}

Result<Descriptor> ConnectTo(const std::string& path) {
  const auto address = AddressOf(path);
  if (!address) return TooLong(path);
  Descriptor socket(::socket(AF_UNIX, kType, 0));
  if (!socket || ::connect(socket.get(), Plain(*address), sizeof *address) != 0) {
    return Failed(path);
  }
  return socket;
}

namespace {

/// True if no process listens at the socket file, so that it may be removed. A process that does
/// not accept at the moment is a listener, too.
bool IsLeftBehind(const sockaddr_un& address) {
  const Descriptor socket(::socket(AF_UNIX, kType, 0));
  return socket && ::connect(socket.get(), Plain(address), sizeof address) != 0 &&
         errno == ECONNREFUSED;
}

}  // namespace

Result<Descriptor> ListenAt(const std::string& path, const std::string& group) {
  const auto address = AddressOf(path);
  if (!address) return TooLong(path);
  struct stat found {};
  if (::lstat(path.c_str(), &found) == 0) {
    if (!S_ISSOCK(found.st_mode))
      return Error{path + ": this path is a file, not a socket; remove the file"};
    if (ConnectTo(path).ok()) {
      return Error{path +
                   ": another process answers at this socket; is this gateway running already?"};
    }
    if (!IsLeftBehind(*address)) {
      return Error{path + ": another process has this socket; is this gateway running already?"};
    }
    ::unlink(path.c_str());
  }
  Descriptor socket(::socket(AF_UNIX, kType, 0));
  if (!socket) return Failed(path);
  // bind() gives the file the mode of the descriptor, so there is no moment at which other users
  // could connect.
  ::fchmod(socket.get(), kMode);
  if (::bind(socket.get(), Plain(*address), sizeof *address) != 0) return Failed(path);
  if (const struct ::group* entry = ::getgrnam(group.c_str()); entry != nullptr) {
    if (::chown(path.c_str(), static_cast<uid_t>(-1), entry->gr_gid) != 0) return Failed(path);
  }
  if (::chmod(path.c_str(), kMode) != 0 || ::listen(socket.get(), 1) != 0) return Failed(path);
  return socket;
}

std::optional<Peer> AcceptPeer(int listener) {
  Peer peer;
  peer.socket = Descriptor(::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!peer.socket) return std::nullopt;
  ucred who{};
  socklen_t size = sizeof who;
  if (::getsockopt(peer.socket.get(), SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) {
    return std::nullopt;
  }
  peer.process = who.pid;
  peer.user = who.uid;
  return peer;
}

}  // namespace baudgate::dds
