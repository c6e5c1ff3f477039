// The inverter of the drive benchmark.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "config/model/device.h"
#include "config/model/serial.h"
#include "gateway/tools/simulate/pty.h"
#include "protocols/protocol.h"

namespace baudgate::bench {

class DriveValues final : public protocols::TwinValues {
 public:
  explicit DriveValues(const config::Device& device) {
    for (std::size_t i = 0; i < device.points.size(); ++i) index_[device.points[i].name] = i;
  }
  Value Get(std::size_t point, Instant) const override {
    if (point == index_.at("output_frequency")) {
      return running_ ? set_frequency_ : Value(std::uint64_t{0});
    }
    if (point == index_.at("set_frequency")) return set_frequency_;
    return std::uint64_t{0};
  }
  void Set(std::size_t point, const Value& value) override {
    if (point == index_.at("set_frequency")) set_frequency_ = value;
    if (point == index_.at("status_word")) running_ = ToDouble(value) != 0;
  }

 private:
  static double ToDouble(const Value& value) {
    if (const auto* whole = std::get_if<std::uint64_t>(&value)) return static_cast<double>(*whole);
    if (const auto* number = std::get_if<std::int64_t>(&value)) return static_cast<double>(*number);
    const auto* real = std::get_if<double>(&value);
    return real != nullptr ? *real : 0;
  }

  std::map<std::string, std::size_t> index_;
  Value set_frequency_ = std::uint64_t{2500};
  bool running_ = false;
};

struct OnWire {
  Instant from;
  std::string pdu;
};

/// An inverter as a Modbus RTU slave on a pty. It paces bytes at the bit rate, thinks for 5 ms,
/// sends long replies in fragments, and counts violations of the protocol's timing.
class Drive {
 public:
  Drive(const protocols::Protocol& rtu, const config::Device& device,
        const config::SerialSettings& serial);
  ~Drive();

  const std::string& path() const { return pty_.path(); }
  std::vector<OnWire> log() const;
  std::atomic<int> overlaps = 0;
  /// Number of silences before a request that are shorter than 3.5 characters.
  std::atomic<int> short_silences = 0;
  std::atomic<std::uint64_t> bytes_in = 0;
  std::atomic<std::uint64_t> bytes_out = 0;

 private:
  void Run();
  /// Sends the reply. Returns when its last byte has left. The estimate can be too early, but not
  /// too late.
  Instant Answer(View request, Instant begin);

  tools::Pty pty_;
  const Duration character_;
  DriveValues values_;
  std::unique_ptr<protocols::Twin> twin_;
  mutable std::mutex mutex_;
  std::vector<OnWire> log_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace baudgate::bench
