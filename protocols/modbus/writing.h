// What a write of points sends: one request, or for bits of a register without function 22 two
// reads and a write. Used by conversation.h; no framing here.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/settings.h"

namespace baudgate::protocols::modbus {

class Writing {
 public:
  /// Both outlive it.
  Writing(const config::Device& device, const Settings& settings)
      : device_(device), settings_(settings) {}

  /// See Conversation::WritesTogether. Bits of one register always; adjacent registers or coils
  /// with `write_together`.
  std::size_t Together(std::span<const PointValue> writes) const;

  struct Step {
    Bytes pdu;
    bool reads = false;  ///< it only prepares: nothing is written by it
  };
  /// The next request of the task. An error: a value does not fit.
  Result<Step> Next(const Task& task);

  /// The register as a step that reads has shown it. Error: it is not what it was a moment ago.
  Status OnRead(std::uint16_t value);
  /// The task has ended, or starts again.
  void Forget() { seen_.clear(); }

 private:
  struct Part {
    Location place;
    const config::Point* point = nullptr;
    Value value;
  };
  /// Some bits of one register.
  struct Bits {
    std::uint16_t address = 0;
    std::uint16_t mask = 0;
    std::uint16_t set = 0;
    bool operator==(const Bits&) const = default;
  };

  Result<std::vector<Part>> PartsOf(const Task& task) const;
  static Result<double> LevelOf(const Part& part);
  static Result<Bits> BitsOf(const std::vector<Part>& parts);
  Step StepOf(const Bits& bits);
  Result<Bytes> CoilsPdu(const std::vector<Part>& parts) const;
  Result<Bytes> RegistersPdu(const std::vector<Part>& parts) const;

  const config::Device& device_;
  const Settings& settings_;
  Bits bits_;                        // that seen_ is about
  std::vector<std::uint16_t> seen_;  // the register, as read for this task
};

/// The points that may show something else when their slave has carried out this request: it writes
/// to where they are read, or written. Nothing: not known.
std::optional<std::vector<std::size_t>> ChangedPoints(View pdu, const config::Device& device);

}  // namespace baudgate::protocols::modbus
