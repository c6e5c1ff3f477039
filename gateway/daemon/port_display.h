// What status and trace show of a line's port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "gateway/store/point_store.h"
#include "gateway/trace/line_recorder.h"

namespace baudgate {

class PortDisplay {
 public:
  /// Both outlive it. `line`: its number in the store.
  PortDisplay(PointStore& store, std::uint32_t line, LineRecorder& recorder)
      : store_(store), line_(line), recorder_(recorder) {}

  /// `released_until`: of a port that is lent.
  void Show(LineStatus::Port port, const std::string& text, Now now, WallTime released_until = {}) {
    text_ = text;
    Update([&](LineStatus& status) {
      if (status.port != port || status.port_text.empty()) status.port_since = now.wall;
      status.port = port;
      status.port_text = text;
      status.released_until = released_until;
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
