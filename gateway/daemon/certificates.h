// `Certificates` knows when the certificates of the configuration end: those of TLS
// (config::TlsUses), and the identity of DDS Security. It reads their files at the start, after a
// reload and once an hour, on a separate thread, because a disk can hang. 30 days before the end of
// a certificate, status and log get a sentence, and an alarm is raised.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::daemon {

class Certificates {
 public:
  static constexpr Duration kEvery = 1h;

  Certificates();
  /// Does not wait for the disk.
  ~Certificates();
  Certificates(const Certificates&) = delete;
  Certificates& operator=(const Certificates&) = delete;

  /// Requests that the files are read. To be called at the start and after a reload; any thread may
  /// call it.
  void Apply(const config::Config& config);
  /// Requests that the files are read if kEvery has passed, and writes new sentences to the log. To
  /// be called periodically, on one thread.
  void Tick(Now now);

  // Any thread may call the following functions; they do not wait for the disk.

  /// Returns the end of each certificate that could be read.
  std::vector<status::CertificateEnd> ends() const;
  /// Returns a sentence with the remedy for each certificate that ends soon, that has ended or that
  /// cannot be read.
  std::vector<std::string> Sentences(WallTime now) const;
  /// Returns why the alarm must be raised; an empty text: it must not; nothing: no file has been
  /// read yet.
  std::optional<std::string> Alarm(WallTime now) const;

 private:
  struct State;
  // Shared with the thread, which can outlive this object while the disk hangs.
  const std::shared_ptr<State> state_;
  Instant asked_ = Instant::min();  // for Tick only
  std::set<std::string> told_;      // for Tick only: sentences that are in the log
  Worker worker_;
};

}  // namespace baudgate::daemon
