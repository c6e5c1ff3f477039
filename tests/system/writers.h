// Clients that write the outputs of one analog module at the same time. A value shows its client
// and the number of the write: 3.003 V is the third write of client 3.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/system/route_station.h"

namespace baudgate::system_test {

struct WriteStep {
  std::string point;
  int address = 0;
  std::string value;
  bool allowed = true;
};

/// Returns the `number`-th write of a client, from 1 on. Every fifth write is forbidden.
WriteStep StepOf(int client, int number);
std::vector<std::uint16_t> RegistersOf(const std::string& value);

enum class Told { confirmed, refused, nothing };

class Writer {
 public:
  virtual ~Writer() = default;
  virtual std::string name() const = 0;
  /// Writes the steps in order and returns one result for each. Called on a thread of its own.
  virtual std::vector<Told> Write(const std::vector<WriteStep>& steps) = 0;
};

using RunOnce = std::function<Finished(const WriteStep& step)>;
using RunPymodbus = std::function<nlohmann::json(const std::vector<std::string>& commands)>;

std::unique_ptr<Writer> LibmodbusWriter(std::uint16_t port);
std::unique_ptr<Writer> RawWriter(std::uint16_t port);
std::unique_ptr<Writer> PymodbusWriter(RunPymodbus run);
/// `refusal` is the program's exit code for a refused write.
std::unique_ptr<Writer> ProgramWriter(std::string name, int refusal, RunOnce run);

}  // namespace baudgate::system_test
