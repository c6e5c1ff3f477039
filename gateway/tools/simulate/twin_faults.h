// Faults that a twin shows on demand: what it says to one request becomes timed pieces of bytes,
// lost, damaged, torn, late or foreign. Sans-I/O: gateway/tools/simulate/simulator.h puts the
// pieces on a pty, tests on a virtual line. Text forms: ParseFault; docs/faults.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

/// Bytes that reach the master together.
struct TimedPiece {
  Duration after;  ///< from the end of the request until the last character is through
  Bytes bytes;
};

struct Fault {
  /// In the order in which they are applied where several strike one reply.
  enum class Kind : std::uint8_t {
    death,          ///< hears nothing and says nothing
    wrong_address,  ///< another device answers in its place
    loss,           ///< the reply is lost
    bits,           ///< bits of the reply are flipped
    stall,          ///< a silence inside the reply
    dribble,        ///< the reply comes byte by byte
    doubled,        ///< the reply comes twice
    garbage_before,
    garbage_after,
    late,  ///< the reply comes later, or with the reply to a later request
    echo,  ///< the request comes back
  };
  Kind kind = Kind::loss;
  double rate = 1;            ///< share of the replies that it strikes, 0…1
  std::uint64_t seed = 1;     ///< the same seed strikes the same exchanges in the same way
  Duration after{};           ///< from the start to its first time
  Duration lasts{};           ///< how long it goes on; zero: to the end
  Duration every{};           ///< from one beginning to the next; zero: only once
  std::size_t count = 1;      ///< bits: flipped ones; garbage: bytes
  Duration pause{};           ///< stall, dribble, double: the silence; late: the delay
  std::size_t exchanges = 0;  ///< late: held back until so many further requests; zero: by `pause`
  std::string text;           ///< as the user wrote it

  /// Whether it may strike so long after the start.
  bool IsDue(Duration since_start) const;
};

std::string_view Name(Fault::Kind kind);

/// How characters travel between the twin and the master.
struct TwinWire {
  config::SerialSettings serial;
  bool paced = false;    ///< each character takes its time; else none does
  Duration think = 5ms;  ///< end of the request to the first byte of the reply

  Duration TimeOf(std::size_t characters) const {
    if (!paced) return {};
    return static_cast<std::int64_t>(characters) * serial.CharacterTime();
  }
};

struct FaultCount {
  std::string fault;            ///< its text
  std::uint64_t struck = 0;     ///< how often
  std::uint64_t exchanges = 0;  ///< of so many that it concerns
};

class TwinFaults {
 public:
  /// What another device says that takes `request` for one of its own, and replies under its own
  /// address. It hears every request that the twin answers, and so keeps its sessions.
  using Stranger = std::function<Bytes(View request, Instant now)>;

  /// Without a stranger wrong_address never strikes. Schedules count from `start`.
  TwinFaults(std::vector<Fault> faults, const TwinWire& wire, Instant start,
             Stranger stranger = {});

  /// A dead device does not hear what it is asked. It comes back with its sessions forgotten.
  bool IsDead(Instant now) const;

  /// What reaches the master after `request`, in the order of time. An empty `reply`: the request
  /// was not for this twin. What an earlier reply left on the wire is waited for.
  std::vector<TimedPiece> Deliver(View request, Bytes reply, Instant end_of_request);

  /// In the order in which the faults were given.
  std::vector<FaultCount> Counts() const;

 private:
  /// A silence, then bytes without a pause between them.
  struct Part {
    Duration pause{};
    Bytes bytes;
  };
  using Speech = std::vector<Part>;

  struct Active {
    Fault fault;
    std::mt19937_64 random;
    FaultCount count;
  };
  struct Held {
    std::size_t exchanges = 0;  // further requests until it is said
    Speech speech;
  };

  /// One request and what comes of it.
  struct Utterance {
    View request;
    Speech speech;
    Bytes foreign;  // what the stranger says
    Bytes echo;
    Duration delay{};
  };

  /// Whether the reply that is said now is one of those that the fault is to strike.
  bool IsChosen(Active& active, Instant now);
  /// False when there was nothing to strike.
  bool Apply(Active& active, Utterance& said);
  static bool Stall(Active& active, Speech& speech);
  static bool Dribble(Active& active, Speech& speech);
  bool FlipBits(Active& active, Speech& speech) const;
  Bytes Garbage(Active& active) const;
  Speech TakeHeld();

  std::vector<Active> faults_;
  TwinWire wire_;
  Instant start_;
  Stranger stranger_;
  std::vector<Held> held_;
  Instant said_until_{};  // the twin's own last character
};

// Faults of a twin as the user writes them: "bits:rate=0.1,count=2,every=60s,for=20s".
// Read from `simulate --fault`; docs/faults.md lists kinds and keys.

/// An error names the fault and the key, and says what may stand there.
Result<Fault> ParseFault(std::string_view text);

}  // namespace baudgate::tools
