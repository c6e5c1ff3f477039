// A line of a running gateway, lent for a scan: its port is closed there, and taken back when the
// loan ends. Should this program die, the gateway takes it back by itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <ostream>
#include <string>

#include "gateway/base/time.h"

namespace baudgate {

class LineLoan {
 public:
  /// Null: `code` is the exit code, and `err` has been told why. `socket` as in ReleaseOptions.
  static std::unique_ptr<LineLoan> Take(const std::string& line, const std::string& socket,
                                        std::ostream& err, int& code);
  ~LineLoan();
  LineLoan(const LineLoan&) = delete;
  LineLoan& operator=(const LineLoan&) = delete;

  const std::string& port() const { return port_; }
  /// Called again and again: the loan goes on.
  void Renew(Instant now);

 private:
  LineLoan(std::string line, std::string socket, std::string port)
      : line_(std::move(line)), socket_(std::move(socket)), port_(std::move(port)) {}

  const std::string line_;
  const std::string socket_;
  const std::string port_;
  Instant renewed_{};
};

}  // namespace baudgate
