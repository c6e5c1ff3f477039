// `EncodeSample`, `ParseLink` and others encode and decode the messages between the gateway and
// baudgate-dds. Each packet of the SOCK_SEQPACKET socket between them is one message.
// gateway/outputs/dds/link/process_link.h and gateway/outputs/dds/link/link_server.h send and
// receive the messages.
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
/// The longest message in bytes; a longer packet is refused.
inline constexpr std::size_t kMaxLinkMessage = 8192;
/// The longest time in which baudgate-dds publishes the final samples of all points.
inline constexpr Duration kEndTime = 700ms;

enum class LinkKind : std::uint8_t {
  // from the gateway to baudgate-dds
  open = 1,  ///< opens DDS; later `open` messages replace the writers
  point = 2,
  device = 3,
  gateway = 4,
  end = 5,  ///< publish all points as not connected, wait for acknowledgement, then exit
  reply = 6,
  event = 7,
  alarm = 8,
  // from baudgate-dds to the gateway
  opened = 64,   ///< answer to `open`: DDS is open, samples can be sent
  failed = 65,   ///< answer to `open`: DDS could not be opened; a sentence with what to change
  counts = 66,   ///< LinkCounts: sent after a change, and once a second as a sign of life
  request = 67,  ///< a write request from a client
  /// Answer to `end`: readers of events are connected, and subscribers have acknowledged
  /// everything.
  left = 68,
};

struct LinkOpen {
  std::string gateway;
  ParticipantOptions participant;
  Room room;
  bool requests = false;  ///< true: receive write requests to `gateway`
};

/// The body of `counts`. The counts begin at 0 when the process opens DDS.
struct LinkCounts {
  Subscribers subscribers;
  std::uint64_t written = 0;  ///< samples that the library accepted
  /// Samples of points, devices and the gateway that the library did not accept.
  std::uint64_t refused = 0;
  std::uint64_t dropped = 0;  ///< write requests that came too fast or found no space
  /// Events and alarms that were lost: the library did not accept them, and the retry queue was
  /// full.
  std::uint64_t events_dropped = 0;
  DatagramCounters datagrams{};
  Neighbours neighbours{};

  bool operator==(const LinkCounts&) const = default;
};

/// The Encode functions return whole packets.
Bytes EncodeOpen(const LinkOpen& open);
Bytes EncodeFailed(const std::string& sentence);  ///< `sentence` is cut after 1,000 bytes
Bytes EncodeCounts(const LinkCounts& counts);
Bytes EncodeBare(LinkKind kind);  ///< for `end`, `opened` and `left`, which have no body
/// Writes a packet into `to`, without allocating. Returns its length; 0 if the sample is longer
/// than its bounds or `to` is shorter than kMaxLinkMessage.
template <typename Sample>
std::size_t EncodeSample(LinkKind kind, const Sample& sample, std::span<std::uint8_t> to);
/// Returns an empty packet if the request is longer than its bounds. `received`, a time of the
/// steady clock, is sent unchanged, because both processes run on this machine.
Bytes EncodeRequest(const WriteArrival& arrival);

struct LinkMessage {
  LinkKind kind{};
  View body;  ///< part of the packet
};

/// Checks the header of a packet. The error completes the sentence "the gateway sent …": it is too
/// short, has another version, an unknown kind, or a wrong length.
Result<LinkMessage> ParseLink(View packet);

/// The Decode functions check every field of a body against its bound, and refuse extra bytes.
Result<LinkOpen> DecodeOpen(View body);
Result<LinkCounts> DecodeCounts(View body);
Result<WriteArrival> DecodeRequest(View body);
std::string DecodeFailed(View body);  ///< returns a printable text of at most 1,000 bytes

}  // namespace baudgate::dds
