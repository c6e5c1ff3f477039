// `TwinFaults` applies faults to the replies of a simulated device: a reply becomes timed pieces of
// bytes that can be lost, damaged, torn, late or from another device. No I/O:
// gateway/tools/simulate/simulator.h sends the pieces on a pty, tests on a virtual line.
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

struct TimedPiece {
  Duration after;  ///< from the end of the request to the end of the last character in `bytes`
  Bytes bytes;
};

struct Fault {
  /// The kinds of faults. If several faults strike one reply, they are applied in this order.
  enum class Kind : std::uint8_t {
    death,  ///< the device receives nothing and sends nothing
    wrong_address,
    loss,
    bits,
    stall,  ///< the reply contains a silence
    dribble,
    doubled,
    garbage_before,
    garbage_after,
    late,  ///< the reply comes later, or with the reply to a later request
    echo,
  };
  Kind kind = Kind::loss;
  double rate = 1;         ///< share of the replies that the fault strikes, 0…1
  std::uint64_t seed = 1;  ///< runs with the same seed strike the same exchanges in the same way
  Duration after{};        ///< from the start of the simulation to the first occurrence
  Duration lasts{};        ///< duration of an occurrence; zero: the fault does not end
  Duration every{};  ///< from the start of one occurrence to the start of the next; zero: only once
  std::size_t count = 1;  ///< number of flipped bits (bits), or of bytes (garbage_before, _after)
  Duration pause{};       ///< the silence (stall, dribble, doubled), or the delay (late)
  std::size_t exchanges = 0;  ///< delay of the kind late, in requests; zero: the delay is `pause`
  std::string text;           ///< the fault as the user wrote it

  bool IsDue(Duration since_start) const;
};

std::string_view Name(Fault::Kind kind);

struct TwinWire {
  config::SerialSettings serial;
  bool paced = false;    ///< true: each character takes the time of its bit rate; false: no time
  Duration think = 5ms;  ///< from the end of the request to the first byte of the reply

  Duration TimeOf(std::size_t characters) const {
    if (!paced) return {};
    return static_cast<std::int64_t>(characters) * serial.CharacterTime();
  }
};

struct FaultCount {
  std::string fault;
  std::uint64_t struck = 0;
  std::uint64_t exchanges = 0;  ///< number of exchanges that the fault could have struck
};

class TwinFaults {
 public:
  /// Returns the reply of another device to `request`, with that device's address. Called for each
  /// request that the simulated device answers, so that the sessions of the other device stay
  /// valid.
  using Stranger = std::function<Bytes(View request, Instant now)>;

  /// `stranger`: see Stranger; empty: the fault wrong_address never occurs. The times of the faults
  /// count from `start`.
  TwinFaults(std::vector<Fault> faults, const TwinWire& wire, Instant start,
             Stranger stranger = {});

  /// True while the fault `death` is active. When the fault ends, the caller must create a new
  /// simulated device, because a restarted device has lost its sessions.
  bool IsDead(Instant now) const;

  /// Returns the bytes that the master receives after `request`, sorted by time. `reply` empty: the
  /// request was not for this simulated device. Pieces of earlier replies that are still on the
  /// wire come first.
  std::vector<TimedPiece> Deliver(View request, Bytes reply, Instant end_of_request);

  /// Returns the counts of the faults, in the order of the constructor's argument.
  std::vector<FaultCount> Counts() const;

 private:
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
    std::size_t exchanges = 0;  // number of further requests until the reply is sent
    Speech speech;
  };

  struct Utterance {
    View request;
    Speech speech;
    Bytes foreign;  // reply of another device, for wrong_address
    Bytes echo;
    Duration delay{};
  };

  /// True if the fault strikes this reply. Counts the exchange.
  bool IsChosen(Active& active, Instant now);
  /// Applies a fault. Returns false if there was nothing that it could change.
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
  Instant said_until_{};
};

// `ParseFault` reads a fault as the user writes it for `simulate --fault`. Example:
// "bits:rate=0.1,count=2,every=60s,for=20s". docs/faults.md lists the kinds and keys.

/// The error tells the fault, the key and the permitted values.
Result<Fault> ParseFault(std::string_view text);

}  // namespace baudgate::tools
