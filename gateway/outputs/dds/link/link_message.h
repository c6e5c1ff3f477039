// `EncodeSample`, `ParseLink` and others encode and decode the messages between the gateway and
// baudgate-dds. Each packet of their SOCK_SEQPACKET socket is one message. process_link.h and
// link_server.h send and receive.
// SPDX-License-Identifier: Apache-2.0
//
//   02 07 5C 00 | 00 01 00 00 06 00 00 00 73 75 …
//   kind `point`, version 7, 92 bytes follow | the sample (gateway/outputs/dds/published_types.h)
//
// All numbers are little-endian.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

inline constexpr std::uint8_t kLinkVersion = 7;
inline constexpr std::size_t kLinkHeaderBytes = 4;
/// In bytes; a longer packet is refused.
inline constexpr std::size_t kMaxLinkMessage = 8192;
/// The most time that baudgate-dds takes to publish the final samples of all points.
inline constexpr Duration kEndTime = 700ms;

enum class LinkKind : std::uint8_t {
  // from the gateway to baudgate-dds
  open = 1,     ///< first: what to open; later: replace the writers by ones with another room
  point = 2,    ///< a sample to publish
  device = 3,   ///< a sample to publish
  gateway = 4,  ///< a sample to publish
  end = 5,      ///< publish that all points are gone, wait for acknowledgement, then exit
  reply = 6,    ///< a reply to a write request
  event = 7,    ///< a sample to publish
  alarm = 8,    ///< a sample to publish
  // from baudgate-dds to the gateway
  opened = 64,  ///< answer to `open`: ready for samples
  failed = 65,  ///< other answer to `open`: what to change, one sentence
  counts = 66,  ///< LinkCounts: after a change, and once a second to show that the process is alive
  request = 67,  ///< a write request from a client
  left = 68,     ///< answer to `end`, if subscribers have acknowledged everything, also events
};

/// The body of `open`: what baudgate-dds is to open.
struct LinkOpen {
  std::string gateway;  ///< the gateway's name
  ParticipantOptions participant;
  Room room;
  bool requests = false;  ///< true: receive write requests to `gateway`
};

/// The body of `counts`. It counts from the time at which the process opened DDS.
struct LinkCounts {
  Subscribers subscribers;
  std::uint64_t written = 0;  ///< samples
  std::uint64_t refused = 0;  ///< samples that the library did not accept
  std::uint64_t dropped = 0;  ///< write requests without room in the queue
  /// Events and alarms that the library did not accept, and without room in the queue.
  std::uint64_t events_dropped = 0;
  DatagramCounters datagrams{};
  Neighbours neighbours{};

  bool operator==(const LinkCounts&) const = default;
};

/// Return whole packets.
Bytes EncodeOpen(const LinkOpen& open);
Bytes EncodeFailed(const std::string& sentence);  ///< cut after 1,000 bytes
Bytes EncodeCounts(const LinkCounts& counts);
Bytes EncodeBare(LinkKind kind);  ///< for `end`, `opened` and `left`, which have no body
/// Writes a packet into `to`, without allocating. Returns its length; 0 if the sample is longer
/// than its bounds or `to` is shorter than kMaxLinkMessage.
template <typename Sample>
std::size_t EncodeSample(LinkKind kind, const Sample& sample, std::span<std::uint8_t> to);
/// Empty if the request is longer than its bounds. `received` is sent as it is, because both
/// processes use the clock of this machine.
Bytes EncodeRequest(const WriteArrival& arrival);

struct LinkMessage {
  LinkKind kind{};
  View body;  ///< part of the packet
};

/// Checks the header. The error continues "sent …": too short, another version, an unknown kind, or
/// a wrong length.
Result<LinkMessage> ParseLink(View packet);

/// Check every field of a body against its bound, and refuse extra bytes.
Result<LinkOpen> DecodeOpen(View body);
Result<LinkCounts> DecodeCounts(View body);
Result<WriteArrival> DecodeRequest(View body);
std::string DecodeFailed(View body);  ///< printable, at most 1,000 bytes

}  // namespace baudgate::dds
