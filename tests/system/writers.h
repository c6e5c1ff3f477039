// Clients that write the outputs of one analog module, each in its own way, for tests in which they
// do so at once. Another kind of client is another Writer.
//
//   client 3, third write: output 2 becomes 3.003 V. So a value says who has written it, and when.
//
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
  std::string point;  ///< "output_2"
  int address = 0;    ///< of its register
  std::string value;  ///< "3.003"
  bool allowed = true;
};

/// The `number`-th write of a client, from 1 on; every fifth is one that the rules forbid.
WriteStep StepOf(int client, int number);
/// The registers of a float32.
std::vector<std::uint16_t> RegistersOf(const std::string& value);

/// What a client was told of one write.
enum class Told { confirmed, refused, nothing };

class Writer {
 public:
  virtual ~Writer() = default;
  virtual std::string name() const = 0;
  /// In their order; as many answers as steps. On a thread of its own.
  virtual std::vector<Told> Write(const std::vector<WriteStep>& steps) = 0;
};

/// Runs a program that writes one value and ends.
using RunOnce = std::function<Finished(const WriteStep& step)>;
/// Runs the commands of pymodbus_master.py.
using RunPymodbus = std::function<nlohmann::json(const std::vector<std::string>& commands)>;

std::unique_ptr<Writer> LibmodbusWriter(std::uint16_t port);
/// Bytes of our own: eight requests under way at once.
std::unique_ptr<Writer> RawWriter(std::uint16_t port);
std::unique_ptr<Writer> PymodbusWriter(RunPymodbus run);
/// `refusal`: the exit code with which it says that a write was refused.
std::unique_ptr<Writer> ProgramWriter(std::string name, int refusal, RunOnce run);

}  // namespace baudgate::system_test
