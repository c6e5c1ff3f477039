// The PLC of the drive benchmark.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "tests/support/raw_client.h"

namespace baudgate::bench {

inline constexpr Duration kPlcPeriod = 30ms;
inline constexpr std::array<std::uint16_t, 9> kBlocks = {999,  1119, 1239, 1359, 1479,
                                                         1599, 1719, 1839, 1959};

/// Returns the PDU of the start command as hex.
std::string StartPdu();

/// A PLC as Modbus TCP client. It sends a message again when the message's period is over and the
/// last exchange has ended.
class Plc {
 public:
  /// `watch_port` is the listener for reads of the frequency, `port` for everything else.
  Plc(std::uint16_t port, std::uint16_t watch_port, bool blocks);

  void Run();

  struct Start {
    Instant sent;
    std::optional<Instant> seen;  ///< when the first non-zero frequency was read
  };
  std::vector<Start> starts;
  int mismatches = 0;
  int exceptions = 0;
  std::uint64_t answered = 0;

 private:
  struct Message {
    std::string pdu;
    bool waits = false;
    Instant next{};
  };
  struct Sent {
    std::string pdu;
    Message* message;
  };

  void Fire(Message& message, Instant now);
  void FireBlocks();
  void Send(const std::string& pdu, Message* message);
  void Receive();

  RawClient client_;
  RawClient watch_;
  bool blocks_;
  std::vector<Message> cyclic_;
  Message block_;
  std::size_t block_turn_ = 0;
  std::uint16_t transaction_ = 0;
  std::map<std::uint16_t, Sent> sent_;
  std::optional<Instant> starts_pending_;
};

}  // namespace baudgate::bench
