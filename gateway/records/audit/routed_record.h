// Writes that are passed on to a slave as they are: their records are made after the exchange, and
// nothing waits for them. Called by gateway/outputs/modbus/service for every routed request except
// reads.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/bus/writes/routed.h"
#include "gateway/records/audit/write_log.h"

namespace baudgate::audit {

struct RoutedWrite {
  std::string client;
  std::string target;     ///< name of the line, or "10.0.0.9:502"
  std::uint8_t unit = 0;  ///< as the client addresses it
  bool broadcast = false;
  View pdu;
  Now asked;
};

/// Function, address and at most 16 values: "06 holding 100", 7; "16 holding 100-101", "1 2". Only
/// the code for functions other than 5, 6, 15, 16, 22 and 23.
WriteRecord RecordOf(const RoutedWrite& write);

/// The record of one request. Reports once to the log how the request ended; if all copies of
/// Watch's function are destroyed without a call, that its result is not known.
class Witness {
 public:
  /// `log` outlives it.
  Witness(WriteLog& log, const RoutedWrite& write);
  ~Witness();
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  using Done = std::function<void(RoutedReply)>;
  /// Returns `done`, which also reports to the log.
  static Done Watch(std::shared_ptr<Witness> witness, Done done);
  /// The gateway has denied it.
  void Deny(WriteEnd end, const std::string& reason);

 private:
  void Tell(const Ending& ending);

  WriteLog& log_;
  WriteRecord record_;
  const Instant asked_;
  const bool broadcast_;
  bool told_ = false;
};

}  // namespace baudgate::audit
