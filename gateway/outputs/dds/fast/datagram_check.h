// `DatagramCheck` checks each datagram before the DDS library gets it, because a single datagram of
// any sender can trigger faults of Fast DDS 2.9. It uses no socket, no clock and no Fast DDS; its
// memory is bounded. Source: DDSI-RTPS 2.3, chapters 8.3, 9.4.
//
//   52 54 50 53 | 02 03 | 01 0F | GUID prefix (12) | submessages: id, flags, length (2), …
//
// Parts that the standard tells receivers to skip are accepted if their length fits (8.3.4.1).
// Fragments are refused, even if they are correct.
//
// DatagramGate makes the check available to the receiving threads, and counts datagrams.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/fast/domain_tables.h"
#include "gateway/outputs/dds/rtps/announcement.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

namespace baudgate::dds {

// SecuredOrder and HandshakeBudget check the parts of DDS Security that can be checked without
// keys: the order and lengths of its submessages, and the number of handshake messages, which are
// not encrypted. Source: DDS Security 1.1, 7.3.6 and 9.5.3.3.
//
//   52 54 50 53 … | 33 SRTPS_PREFIX | 30 SEC_BODY, encrypted | 34 SRTPS_POSTFIX
//   52 54 50 53 … | 31 SEC_PREFIX | 30 SEC_BODY, or a submessage that is signed | 32 SEC_POSTFIX

enum class Secured : std::uint8_t {
  off,       ///< every submessage of DDS Security is refused
  allowed,   ///< submessages of DDS Security are accepted if well formed
  demanded,  ///< submessages must be protected, except discovery and handshakes
};

class SecuredOrder {
 public:
  /// Takes the next submessage; `first`: it is the first of the datagram. False if `id` is not
  /// allowed at this position.
  bool Next(std::uint8_t id, bool first);
  /// True if every prefix was followed by its postfix.
  bool complete() const { return !message_ && step_ == Step::outside; }
  /// True if the next submessage is protected or is the postfix of the message.
  bool open() const { return message_ || step_ == Step::prefix; }
  bool inside() const { return inside_; }

 private:
  enum class Step : std::uint8_t { outside, prefix, body };

  Step step_ = Step::outside;
  bool message_ = false;  ///< the position is between SRTPS_PREFIX and SRTPS_POSTFIX
  bool ended_ = false;
  bool inside_ = false;
};

/// Limits handshake messages, because the library may have to verify a signature for each: 512
/// messages at once, then 128 per second; half as many from one address.
class HandshakeBudget {
 public:
  HandshakeBudget();
  bool Take(std::uint32_t address, Instant now);

 private:
  struct Source {
    std::uint32_t address = 0;
    Instant full_at{};
  };
  std::vector<Source> sources_;
  Instant full_at_{};
};

using Sender = UdpAddress;

/// Bytes `at`…`at`+7 of the datagram are overwritten with `bytes` before the library gets it.
struct Edit {
  std::size_t at = 0;
  std::array<std::uint8_t, 8> bytes{};
};

struct Verdict {
  Refusal reason = Refusal::none;
  /// The number of bytes to pass on. A vendor's submessages at the end are cut off: Fast DDS 2.9
  /// sends one (0x80, statistics) in each datagram, and a forged one terminates the process.
  std::size_t length = 0;
  /// Edits that shorten leases to ParticipantLimits::longest_lease, because the library stores a
  /// silent participant until its lease ends, and sends to it all that time.
  std::array<Edit, 4> edits{};
  std::size_t edit_count = 0;
  /// Positions of parameter ids (two bytes each) to overwrite with 0, so that the library skips the
  /// parameters as padding. Hidden in this way are:
  /// * descriptions of types, which the library would parse and store without need;
  /// * multicast groups for samples, because Fast DDS 2.9 ends in an assertion
  ///   (OutputTrafficManager.hpp:87) if two subscribers name the same group, as Cyclone DDS does.
  ///   Without the group it sends to each subscriber separately.
  std::array<std::uint16_t, 256> hidden{};
  std::size_t hidden_count = 0;

  bool passes() const { return reason == Refusal::none; }
};

struct CheckOptions {
  Secured security = Secured::off;
  /// Addresses of the discovery servers. A participant that a server announces counts for the
  /// address in the announcement, not for the server's address.
  std::vector<UdpAddress> servers{};
  ParticipantLimits participants{};
  WindowLimits window{};
  EndpointLimits endpoints{};
};

class DatagramCheck {
 public:
  explicit DatagramCheck(const CheckOptions& options);

  Verdict Check(View datagram, Sender sender, Instant now);

  const ParticipantTable& participants() const { return participants_; }

 private:
  struct Submessage;
  struct Walk;

  Refusal CheckSubmessage(const Submessage& submessage, Walk& walk);
  Refusal CheckData(const Submessage& submessage, Walk& walk);
  Refusal CheckPayload(const Submessage& submessage, std::size_t at, std::uint32_t reader,
                       std::uint32_t writer, std::uint32_t status, Walk& walk);
  Refusal AdmitEndpoint(const struct Parameters& announced, bool gone, Instant now);
  bool Hide(const struct Parameters& announced, std::size_t list_at, Verdict& verdict) const;
  Refusal CheckHandshake(View payload, std::uint16_t kind, const Walk& walk);
  Refusal CheckHeartbeat(const Submessage& submessage, Walk& walk);
  Refusal CheckGap(const Submessage& submessage, Walk& walk);
  Refusal Admit(const struct Parameters& announced, std::size_t list_at, bool little, bool gone,
                Walk& walk);
  void Describe(const struct Parameters& announced, Sender sender);
  std::uint32_t AddressOf(const struct Parameters& announced, Sender sender) const;
  bool Advance(const Walk& walk, std::uint32_t writer, std::int64_t to, std::int64_t skipped);

  bool MayBeClear(const Submessage& submessage, const Walk& walk) const;

  const Secured security_;
  const std::vector<UdpAddress> servers_;
  ParticipantTable participants_;
  SequenceWindow window_;
  EndpointTable endpoints_;
  HandshakeBudget handshakes_;
};

// DatagramGate makes a DatagramCheck usable by the receiving threads of the DDS library, counts
// datagrams and logs refusals.
class DatagramGate {
 public:
  /// Takes a log line about refused datagrams, at most one in 10 s: reason, sender's address,
  /// number of earlier refusals.
  using Tell = std::function<void(const std::string& line)>;

  DatagramGate(const CheckOptions& options, Tell tell);

  /// Returns the bytes to pass to the library (part of `datagram`, some bytes may be changed in
  /// place); empty: the datagram is refused. Any thread may call it.
  std::span<std::uint8_t> LetIn(std::span<std::uint8_t> datagram, Sender sender, Instant now);

  DatagramCounters counters() const;
  struct Known {
    std::vector<UdpAddress> reached;
    std::vector<UdpAddress> unanswered;
  };
  Known known(Instant now) const;

 private:
  void Fold(Refusal reason, Sender sender, Instant now) BAUDGATE_REQUIRES(mutex_);

  const Tell tell_;
  mutable Mutex mutex_;
  DatagramCheck check_ BAUDGATE_GUARDED_BY(mutex_);
  DatagramCounters counters_ BAUDGATE_GUARDED_BY(mutex_);
  Instant silent_until_ BAUDGATE_GUARDED_BY(mutex_){};
  std::uint64_t folded_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

}  // namespace baudgate::dds
