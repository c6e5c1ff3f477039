// Writing builds the requests of a write task: one request, or two reads and a write for bits of a
// register if the device has no mask write (function 22). It works on PDUs, without framing.
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
  Writing(const config::Device& device, const Settings& settings)
      : device_(device), settings_(settings) {}

  /// See Conversation::WritesTogether. Bits of one register are always written together; adjacent
  /// registers or coils only with the option `write_together`.
  std::size_t Together(std::span<const PointValue> writes) const;

  struct Step {
    Bytes pdu;
    bool reads = false;  ///< true: the request is a preparing read, and nothing is written yet
  };
  /// Returns the next request of the task. The error names the value that does not fit.
  Result<Step> Next(const Task& task);

  /// Call it with the register that a preparing read returned. Returns an error if the register has
  /// changed since the first read.
  Status OnRead(std::uint16_t value);
  /// Call it when the task has ended or starts again: the values of its preparing reads are
  /// dropped.
  void Forget() { seen_.clear(); }

 private:
  struct Part {
    Location place;
    const config::Point* point = nullptr;
    Value value;
  };
  /// The bits of one register to write: `mask` has a 1 for each of them, `set` their new states.
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
  Bits bits_;                        // the bits for which the values in seen_ were read
  std::vector<std::uint16_t> seen_;  // values of the register, as read for this task
};

/// Returns the indices of the points whose values can change when the slave carries out the
/// request: points whose location in `read` or `write` overlaps the written range. Empty: the
/// effect of the request is unknown.
std::optional<std::vector<std::size_t>> ChangedPoints(View pdu, const config::Device& device);

}  // namespace baudgate::protocols::modbus
