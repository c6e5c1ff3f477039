// SPDX-License-Identifier: Apache-2.0
#include "tests/system/writers.h"

#include <bit>
#include <cstdio>
#include <map>
#include <utility>

#include "tests/system/messages.h"

namespace baudgate::system_test {
namespace {

constexpr std::uint8_t kWriterUnit = 1;
constexpr int kOutputs = 4;
constexpr int kForbidden = 5;

std::string Number(int client, int number, const char* more = "") {
  char text[32];
  std::snprintf(text, sizeof text, "%d.%03d%s", client, number, more);
  return text;
}

Told ToldBy(int exception) {
  if (exception == kNoException) return Told::confirmed;
  return exception > 0 ? Told::refused : Told::nothing;
}

class Libmodbus final : public Writer {
 public:
  explicit Libmodbus(std::uint16_t port) : client_(port) {}
  std::string name() const override { return "libmodbus"; }
  std::vector<Told> Write(const std::vector<WriteStep>& steps) override {
    std::vector<Told> told;
    for (const WriteStep& step : steps) {
      told.push_back(
          ToldBy(client_.WriteRegisters(kWriterUnit, step.address, RegistersOf(step.value))));
    }
    return told;
  }

 private:
  ModbusClient client_;
};

class Raw final : public Writer {
 public:
  explicit Raw(std::uint16_t port) : client_(port) {}
  std::string name() const override { return "bytes"; }
  std::vector<Told> Write(const std::vector<WriteStep>& steps) override {
    constexpr std::size_t kUnderWay = 8;
    std::vector<Told> told(steps.size(), Told::nothing);
    std::map<std::uint16_t, std::size_t> open;
    std::size_t next = 0;
    while (next < steps.size() || !open.empty()) {
      for (; next < steps.size() && open.size() < kUnderWay; ++next) {
        Send(client_, RequestOf(++transaction_, steps[next]));
        open.emplace(transaction_, next);
      }
      const auto reply = Receive(client_);
      const auto asked = reply ? open.find(reply->transaction) : open.end();
      if (asked == open.end()) {
        ADD_FAILURE() << (reply ? "an answer to nothing, or a second one" : "no answer");
        return told;
      }
      told[asked->second] = ToldBy(ExceptionIn(*reply));
      open.erase(asked);
    }
    return told;
  }

 private:
  static Message RequestOf(std::uint16_t transaction, const WriteStep& step) {
    Bytes pdu = {0x10, 0, static_cast<std::uint8_t>(step.address), 0, 2, 4};
    for (const std::uint16_t word : RegistersOf(step.value)) {
      pdu.push_back(static_cast<std::uint8_t>(word >> 8U));
      pdu.push_back(static_cast<std::uint8_t>(word & 0xFFU));
    }
    return {transaction, kWriterUnit, pdu};
  }

  RawClient client_;
  std::uint16_t transaction_ = 0;
};

class Pymodbus final : public Writer {
 public:
  explicit Pymodbus(RunPymodbus run) : run_(std::move(run)) {}
  std::string name() const override { return "pymodbus"; }
  std::vector<Told> Write(const std::vector<WriteStep>& steps) override {
    std::vector<std::string> commands;
    for (const WriteStep& step : steps) {
      std::string command = "write_registers:" + std::to_string(step.address);
      for (const std::uint16_t word : RegistersOf(step.value)) {
        command += ":" + std::to_string(word);
      }
      commands.push_back(command);
    }
    std::vector<Told> told;
    for (const auto& result : run_(commands)) {
      const bool refused = result.is_object() && result.contains("exception");
      told.push_back(result == true ? Told::confirmed : refused ? Told::refused : Told::nothing);
    }
    return told;
  }

 private:
  RunPymodbus run_;
};

class Program final : public Writer {
 public:
  Program(std::string name, int refusal, RunOnce run)
      : name_(std::move(name)), refusal_(refusal), run_(std::move(run)) {}
  std::string name() const override { return name_; }
  std::vector<Told> Write(const std::vector<WriteStep>& steps) override {
    std::vector<Told> told;
    for (const WriteStep& step : steps) {
      const int code = run_(step).code;
      told.push_back(code == 0          ? Told::confirmed
                     : code == refusal_ ? Told::refused
                                        : Told::nothing);
    }
    return told;
  }

 private:
  std::string name_;
  int refusal_;
  RunOnce run_;
};

}  // namespace

WriteStep StepOf(int client, int number) {
  const int output = number % kOutputs;
  WriteStep step{"output_" + std::to_string(output), 2 * output, Number(client, number)};
  if (number % kForbidden != 0) return step;
  step.allowed = false;
  switch (number / kForbidden % 3) {
    case 0:
      step.value = Number(client + 10, number);
      break;
    case 1:
      step.value = Number(client, number, "5");
      break;
    default:
      step.point = "safe_" + std::to_string(output);
      step.address = 20 + 2 * output;
  }
  return step;
}

std::vector<std::uint16_t> RegistersOf(const std::string& value) {
  const auto bits = std::bit_cast<std::uint32_t>(std::stof(value));
  return {static_cast<std::uint16_t>(bits >> 16U), static_cast<std::uint16_t>(bits)};
}

std::unique_ptr<Writer> LibmodbusWriter(std::uint16_t port) {
  return std::make_unique<Libmodbus>(port);
}
std::unique_ptr<Writer> RawWriter(std::uint16_t port) { return std::make_unique<Raw>(port); }
std::unique_ptr<Writer> PymodbusWriter(RunPymodbus run) {
  return std::make_unique<Pymodbus>(std::move(run));
}
std::unique_ptr<Writer> ProgramWriter(std::string name, int refusal, RunOnce run) {
  return std::make_unique<Program>(std::move(name), refusal, std::move(run));
}

}  // namespace baudgate::system_test
