// What people see of a line's port: the log, the status, the trace and the news.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/model/line.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/lines/line_reporter.h"
#include "gateway/records/trace/line_recorder.h"
#include "transports/transport.h"

namespace baudgate {

/// A loan of the port, as people see it.
struct ShownLoan {
  WallTime until{};
  bool to_client = false;  ///< over the network; else by hand to another program
};

class PortDisplay {
 public:
  /// All outlive it.
  PortDisplay(PointStore& store, const config::Line& line, LineRecorder& recorder,
              LineReporter& reporter);

  /// `text`: what the port is and how it is set.
  void OnOpened(const std::string& text, Now now);
  struct Down {
    bool first = false;   ///< for this reason, since it worked
    bool silent = false;  ///< closed here, because no device behind it has answered
  };
  void OnDown(const std::string& reason, Down down, Now now);
  /// By hand: the write under way ends first. The epoch: it was called off.
  void OnReleaseAsked(WallTime until);
  /// By hand, to another program.
  void OnReleased(const std::string& port, Duration time, Now now);
  /// The loan is over. The port may have gone meanwhile, so it is not open yet.
  void OnTakenBack(Now now);
  void CountLoss(Now now, bool takes_no_data = false);
  /// The connection has proven that it works.
  void OnWorked() { worked_ = true; }
  /// There is no connection; the first time behind one that has worked counts.
  void CountNoConnection(NoConnection why, Now now);
  void OnConnected(Now now) { connected_ = now.instant; }
  /// The server has ended a connection.
  struct End {
    bool worked = false;  ///< something was answered over it
    bool asked = false;   ///< a request was not answered yet
    bool unread = false;  ///< nor read
  };
  void CountEnd(End end, Now now);
  /// The server has ended a connection that was in use, which is no outage.
  void CountDrop(const std::string& reason, Now now);
  /// It has ended one as it does again and again, which is no trouble.
  void CountRest();

  void Show(LineStatus::Port port, const std::string& text, Now now, ShownLoan loan = {});
  template <typename Change>
  void Update(Change change) {
    store_.UpdateLine(line_, change);
  }
  const std::string& text() const { return text_; }

 private:
  PointStore& store_;
  const std::uint32_t line_;  // its number in the store
  const std::string name_;
  LineRecorder& recorder_;
  LineReporter& reporter_;
  std::string text_;
  Instant connected_{};
  bool worked_ = false;  // the last connection, and no try has failed since
};

}  // namespace baudgate
