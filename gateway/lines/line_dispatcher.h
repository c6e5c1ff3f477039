// Passes requests of outputs to their line: writes, loans of its port, whether a device is in use,
// its trace. The one CommandSink of all lines. From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/lines/line_control.h"
#include "gateway/lines/lines.h"

namespace baudgate {

class LineDispatcher final : public CommandSink, public LineControl {
 public:
  /// All references outlive it.
  LineDispatcher(PointStore& store, const config::Catalog& catalog, const Lines& lines)
      : store_(store), catalog_(catalog), lines_(lines) {}

  bool Submit(WriteCommand command) override;
  void OnNotTaken(const DeniedWrite& denied) override;

  void Release(std::uint32_t line, Duration time) override;
  void Offer(std::uint32_t line, config::PortServer server, Duration time) override;
  void TakeBack(std::uint32_t line) override;
  void SetInUse(std::uint32_t device, bool in_use) override;
  const Protocol* FindProtocol(const std::string& name) const override;
  std::shared_ptr<TraceQueue> Trace(std::uint32_t line, std::function<void()> wake) override;
  std::vector<TraceRecord> Recorded(std::uint32_t line) override;

 private:
  void Count(std::uint32_t device, WriteEnd end);

  PointStore& store_;
  const config::Catalog& catalog_;
  const Lines& lines_;
};

}  // namespace baudgate
