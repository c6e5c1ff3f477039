// What status and trace show of a line's port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "gateway/store/point_store.h"
#include "gateway/trace/line_recorder.h"

namespace baudgate {

/// Of a port that is lent.
struct ShownLoan {
  WallTime until{};
  bool to_client = false;  ///< over the network; else by hand to another program
};

class PortDisplay {
 public:
  /// Both outlive it. `line`: its number in the store.
  PortDisplay(PointStore& store, std::uint32_t line, LineRecorder& recorder)
      : store_(store), line_(line), recorder_(recorder) {}

  void Show(LineStatus::Port port, const std::string& text, Now now, ShownLoan loan = {}) {
    text_ = text;
    Update([&](LineStatus& status) {
      if (status.port != port || status.port_text.empty()) status.port_since = now.wall;
      status.port = port;
      status.port_text = text;
      status.silent = false;
      status.released_until = loan.until;
      status.lent_to_client = loan.to_client;
    });
    recorder_.OnPort(fmt::format("port {}: {}", Name(port), text), now);
  }
  template <typename Change>
  void Update(Change change) {
    store_.UpdateLine(line_, change);
  }
  const std::string& text() const { return text_; }

 private:
  PointStore& store_;
  const std::uint32_t line_;
  LineRecorder& recorder_;
  std::string text_;
};

}  // namespace baudgate
