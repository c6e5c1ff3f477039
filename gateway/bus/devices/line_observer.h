// What the bus tells the diagnosis of a line, and what it is told back for the status. The bus
// works without: this class finds nothing. Implemented by gateway/diagnosis/observer.h. Driven by
// gateway/bus/poller/reception.h, and for a device that sends unasked by
// gateway/bus/jobs/speaker.h, on the thread of the line:
//
//   on the line                          call
//   the port has opened                  OnOpened
//   a request is to be sent              TakeChanged, then OnRequest
//   bytes come that are no echo          OnBytes
//   a whole frame is taken for the reply OnReply
//   the exchange has ended               OnEnd, then TakeNegotiation
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"

namespace baudgate {

/// An earlier exchange as it looks now: the one of `member` that is `back` before its last.
struct EarlierFinding {
  const Member* member = nullptr;
  Finding finding{};
  std::size_t back = 0;
  Duration lateness{};  ///< since it was due; zero: it was not late
};

class LineObserver {
 public:
  virtual ~LineObserver() = default;

  virtual void OnOpened() {}
  virtual void OnRequest(const Member& /*member*/, const Request& /*request*/, Instant /*now*/) {}
  virtual void OnBytes(View /*bytes*/, Instant /*now*/) {}
  virtual void OnReply(View /*frame*/) {}
  /// How the exchange looked.
  virtual Finding OnEnd(Outcome /*outcome*/) { return {}; }
  /// True once: the connection began as Telnet, and yet a device has answered.
  virtual bool TakeNegotiation() { return false; }
  /// Exchanges that look different now, because more has come since they were looked at; each once.
  virtual std::vector<EarlierFinding> TakeChanged() { return {}; }

  /// Bytes of the device that sends unasked. Returns a new finding on the message before, if that
  /// was unreadable and now looks different.
  virtual std::optional<Finding> OnUnaskedBytes(View /*bytes*/, Instant /*now*/) { return {}; }
  /// The first bytes of a connection are Telnet's.
  virtual bool IsNegotiation(View /*bytes*/) const { return false; }
  /// Its message could not be read: returns what it looks like.
  virtual Finding OnUnaskedDamage() { return {.symptom = Symptom::damaged}; }
  virtual void OnUnaskedRead() {}
};

/// Makes the observer of a line; the roster outlives it.
using MakeObserver = std::function<std::unique_ptr<LineObserver>(const Roster& roster)>;

}  // namespace baudgate
