// The messages between the daemon and the DDS process (baudgate-dds), one in each packet of a
// SOCK_SEQPACKET socket: pure encoding and checked decoding.
// gateway/outputs/dds/link/process_link.h and link_server.h carry them.
// SPDX-License-Identifier: Apache-2.0
//
//   02 07 5C 00 | 00 01 00 00 06 00 00 00 73 75 …
//   kind point, version 7, 92 bytes follow | the sample as in gateway/outputs/dds/published_types.h
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
/// No message is longer; a packet that is longer is refused.
inline constexpr std::size_t kMaxLinkMessage = 8192;
/// The process takes this long at most to tell the ends of all points.
inline constexpr Duration kEndTime = 700ms;

enum class LinkKind : std::uint8_t {
  // From the daemon.
  open = 1,     ///< first: what to take part in; later: replace the writers, with other room
  point = 2,    ///< a sample to publish
  device = 3,   ///< the same
  gateway = 4,  ///< the same
  end = 5,      ///< tell the end of all points, wait until subscribers have it, then leave
  reply = 6,    ///< what became of a write request: publish it
  event = 7,    ///< a sample to publish
  alarm = 8,    ///< the same
  // From the process.
  opened = 64,   ///< the answer to open: samples may come
  failed = 65,   ///< the other answer: a sentence that says what to change
  counts = 66,   ///< at a change, and once a second as a sign of life
  request = 67,  ///< somebody asks for a point to be written
  left = 68,     ///< the answer to end, where subscribers have everything, events included
};

struct LinkOpen {
  std::string gateway;  ///< its name
  ParticipantOptions participant;
  Room room;
  bool requests = false;  ///< listen for write requests to `gateway`
};

/// Since the process has opened.
struct LinkCounts {
  Subscribers subscribers;
  std::uint64_t written = 0;         ///< samples
  std::uint64_t refused = 0;         ///< samples that the library did not take
  std::uint64_t dropped = 0;         ///< write requests that found no room
  std::uint64_t events_dropped = 0;  ///< that the library did not take, and that found no room
  DatagramCounters datagrams{};
  Neighbours neighbours{};

  bool operator==(const LinkCounts&) const = default;
};

/// Each gives a whole packet.
Bytes EncodeOpen(const LinkOpen& open);
Bytes EncodeFailed(const std::string& sentence);  ///< what is longer than 1,000 bytes is cut
Bytes EncodeCounts(const LinkCounts& counts);
Bytes EncodeBare(LinkKind kind);  ///< end, opened, left
/// Writes a packet into `to`, without allocating; 0 when the sample is beyond its bounds or `to` is
/// shorter than kMaxLinkMessage.
template <typename Sample>
std::size_t EncodeSample(LinkKind kind, const Sample& sample, std::span<std::uint8_t> to);
/// Empty when the sample is beyond its bounds. The clock of `received` is that of the machine.
Bytes EncodeRequest(const WriteArrival& arrival);

struct LinkMessage {
  LinkKind kind{};
  View body;  ///< within the packet
};

/// The error says in words what is wrong with the packet: too short, another version, an unknown
/// kind, a length that is not the packet's.
Result<LinkMessage> ParseLink(View packet);

/// Bodies. Everything is checked against its bounds, and nothing may follow it.
Result<LinkOpen> DecodeOpen(View body);
Result<LinkCounts> DecodeCounts(View body);
Result<WriteArrival> DecodeRequest(View body);
std::string DecodeFailed(View body);  ///< printable, at most 1,000 bytes

}  // namespace baudgate::dds
