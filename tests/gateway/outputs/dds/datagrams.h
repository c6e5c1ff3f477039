// RTPS datagrams for tests: captured (tests/gateway/outputs/dds/captured.txt) or made.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"

namespace baudgate::dds::testing {

/// A sequence number that no writer reaches.
inline constexpr std::uint64_t kFar = std::uint64_t{1} << 40;
/// Reader and writer of the announcements of publishers, in hex.
inline constexpr char kPublications[] = "00 00 03 C7 00 00 03 C2";

/// Datagrams by name, captured on loopback between Fast DDS 2.9.1 and Cyclone DDS 0.10.2.
inline const std::map<std::string, Bytes>& Captured() {
  static const std::map<std::string, Bytes> captured = [] {
    std::map<std::string, Bytes> read;
    std::ifstream file("tests/gateway/outputs/dds/captured.txt");
    for (std::string name, hex; file >> name >> hex;) read[name] = *ParseHex(hex);
    return read;
  }();
  return captured;
}

/// Returns an RTPS 2.3 header of Fast DDS whose prefix ends in `number`, then `rest_hex`.
inline Bytes Rtps(std::string_view rest_hex, std::uint16_t number = 0) {
  Bytes bytes = *ParseHex("52 54 50 53 02 03 01 0F 01 0F AA BB CC DD 00 00 01 00");
  bytes.push_back(static_cast<std::uint8_t>(number >> 8));
  bytes.push_back(static_cast<std::uint8_t>(number));
  Append(bytes, View(*ParseHex(rest_hex)));
  return bytes;
}

inline void Append32(Bytes& to, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8)
    to.push_back(static_cast<std::uint8_t>(number >> shift));
}

inline Bytes Submessage(std::uint8_t id, std::uint8_t flags, const Bytes& body) {
  Bytes bytes{id, static_cast<std::uint8_t>(flags | 1)};
  bytes.push_back(static_cast<std::uint8_t>(body.size()));
  bytes.push_back(static_cast<std::uint8_t>(body.size() >> 8));
  Append(bytes, View(body));
  return bytes;
}

/// Returns the announcement of an invented participant (RTPS 2.3, 8.5.3) with the discovery readers
/// and writers of Fast DDS on 127.0.0.1. `further`: more parameters in hex, without the sentinel.
inline Bytes AnnouncementOf(std::uint16_t number, std::uint32_t lease_seconds = 20,
                            std::string_view further = "") {
  Bytes body = *ParseHex("00 00 10 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 00 03 00 00");
  Append(body, View(*ParseHex("15 00 04 00 02 03 00 00 16 00 04 00 01 0F 00 00 50 00 10 00")));
  const Bytes header = Rtps("", number);
  Append(body, View(header).subspan(8));
  Append(body, View(*ParseHex("00 00 01 C1 02 00 08 00")));
  Append32(body, lease_seconds);
  Append(body,
         View(*ParseHex("00 00 00 00 58 00 04 00 3F 0C 3F 0C 32 00 18 00 01 00 00 00 39 30 00 00 "
                        "00 00 00 00 00 00 00 00 00 00 00 00 7F 00 00 01")));
  Append(body, View(*ParseHex(further)));
  Append(body, View(*ParseHex("01 00 00 00")));
  Bytes bytes = header;
  Append(bytes, View(Submessage(0x15, 0x04, body)));
  return bytes;
}

inline Bytes Heartbeat(std::uint16_t number, std::string_view reader_writer, std::uint64_t first,
                       std::uint64_t last, std::uint32_t count = 1) {
  Bytes body = *ParseHex(reader_writer);
  for (const std::uint64_t sequence : {first, last}) {
    Append32(body, static_cast<std::uint32_t>(sequence >> 32));
    Append32(body, static_cast<std::uint32_t>(sequence));
  }
  Append32(body, count);
  Bytes bytes = Rtps("", number);
  Append(bytes, View(Submessage(0x07, 0, body)));
  return bytes;
}

inline Bytes Gap(std::uint16_t number, std::string_view reader_writer, std::uint64_t start,
                 std::uint64_t base) {
  Bytes body = *ParseHex(reader_writer);
  for (const std::uint64_t sequence : {start, base}) {
    Append32(body, static_cast<std::uint32_t>(sequence >> 32));
    Append32(body, static_cast<std::uint32_t>(sequence));
  }
  Append32(body, 0);
  Bytes bytes = Rtps("", number);
  Append(bytes, View(Submessage(0x08, 0, body)));
  return bytes;
}

/// Sends datagrams to the discovery ports of this machine. The port of a participant is the base
/// port of the domain + 10 + 2 x the number of the participant.
class DatagramSender {
 public:
  explicit DatagramSender(int domain) : base_(7400 + 250 * domain) {}
  ~DatagramSender() { ::close(socket_); }
  void Send(const Bytes& bytes) {
    for (int offset = 10; offset < 150; offset += 2) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      to.sin_port = htons(static_cast<std::uint16_t>(base_ + offset));
      [[maybe_unused]] const auto sent =
          ::sendto(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL,
                   reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
  }

 private:
  const int base_;
  int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

}  // namespace baudgate::dds::testing
