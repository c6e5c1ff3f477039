// Looks at each datagram before the DDS library does: Fast DDS 2.9 has faults that a sender
// can use with one datagram, if it reaches the port. Bytes come from
// gateway/outputs/dds/fast/participant.cpp. Pure: no socket, no clock, no Fast DDS; memory is
// fixed. Source: DDSI-RTPS 2.3, chapters 8.3, 9.4.
//
//   52 54 50 53 | 02 03 | 01 0F | GUID prefix (12) | submessages: id, flags, length (2), …
//
// A right peer is never refused: what the standard tells receivers to skip passes when its length
// fits (8.3.4.1).
//
// DatagramGate lets datagrams in, and counts them.
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

// What DDS Security puts into datagrams, as far as it can be looked at without keys: the order and
// lengths of its submessages, and the messages of the handshake, which are in clear text. Pure.
// Source: DDS Security 1.1, 7.3.6 and 9.5.3.3.
//
//   52 54 50 53 … | 33 SRTPS_PREFIX | 30 SEC_BODY, encrypted | 34 SRTPS_POSTFIX
//   52 54 50 53 … | 31 SEC_PREFIX | 30 SEC_BODY, or a submessage that is signed | 32 SEC_POSTFIX

enum class Secured : std::uint8_t {
  off,       ///< nothing of DDS Security is let in
  allowed,   ///< let in when it is well formed
  demanded,  ///< and in clear text only announcements and handshakes
};

/// Follows the submessages of one datagram.
class SecuredOrder {
 public:
  /// False: `id` cannot stand here. `first`: it is the first of the datagram.
  bool Next(std::uint8_t id, bool first);
  /// What was begun has been ended.
  bool complete() const { return !message_ && step_ == Step::outside; }
  /// The next submessage is under a signature, unless it ends what is.
  bool open() const { return message_ || step_ == Step::prefix; }
  /// The submessage that Next was told of last is.
  bool inside() const { return inside_; }

 private:
  enum class Step : std::uint8_t { outside, prefix, body };

  Step step_ = Step::outside;
  bool message_ = false;  ///< between SRTPS_PREFIX and SRTPS_POSTFIX
  bool ended_ = false;    ///< behind SRTPS_POSTFIX
  bool inside_ = false;
};

/// Each message of a handshake may cost the library a signature: 512 at once and 128 a second after
/// that, half as many from one address.
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

/// Eight bytes to be overwritten before the datagram is passed on.
struct Edit {
  std::size_t at = 0;
  std::array<std::uint8_t, 8> bytes{};
};

struct Verdict {
  Refusal reason = Refusal::none;
  /// How many bytes to pass on: a vendor's submessages at the end are left off. Fast DDS 2.9 ends
  /// each of its datagrams with one (0x80, statistics), and one that was made up ends the process.
  std::size_t length = 0;
  /// Leases longer than `longest_lease`, shortened: the library keeps a silent participant as long
  /// as it announces, and sends to it all the time.
  std::array<Edit, 4> edits{};
  std::size_t edit_count = 0;
  /// Two bytes each to be overwritten with 0, which makes padding of a parameter: descriptions of
  /// types, which the library takes apart and keeps although nobody needs them, and
  /// multicast groups for samples: where two subscribers name the same one, as Cyclone DDS does,
  /// Fast DDS 2.9 ends in an assertion (OutputTrafficManager.hpp:87). Without the group it sends to
  /// each subscriber separately.
  std::array<std::uint16_t, 256> hidden{};
  std::size_t hidden_count = 0;

  bool passes() const { return reason == Refusal::none; }
};

struct CheckOptions {
  Secured security = Secured::off;
  /// Discovery servers. What one of them passes on counts for the address that it announces, not
  /// for the server's.
  std::vector<UdpAddress> servers{};
  ParticipantLimits participants{};
  WindowLimits window{};
  EndpointLimits endpoints{};
};

class DatagramCheck {
 public:
  explicit DatagramCheck(const CheckOptions& options);

  Verdict Check(View datagram, Sender sender, Instant now);

  /// Participants that the library may know.
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

// Lets datagrams in or not, counts and tells: DatagramCheck for the several threads on which the
// DDS library receives. Used by gateway/outputs/dds/fast/participant.cpp.
class DatagramGate {
 public:
  /// A line for people, once in 10 s at most: what was refused, from whom, how often before.
  using Tell = std::function<void(const std::string& line)>;

  DatagramGate(const CheckOptions& options, Tell tell);

  /// The bytes that may be passed on, some of them changed in place; none: it is refused.
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
