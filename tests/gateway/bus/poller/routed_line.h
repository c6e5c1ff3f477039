// `RoutedLine`: a virtual line with Modbus RTU slaves on the wire, for tests of transparent routes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/support/virtual_line.h"

namespace baudgate::bus {

inline constexpr const char* kRead = "03 00 00 00 01";
inline constexpr const char* kOther = "03 00 01 00 01";
inline constexpr const char* kBlock = "03 00 00 00 78";  // reads 120 registers
inline constexpr const char* kStartDrive = "06 00 00 00 02";
inline constexpr const char* kStop = "06 00 00 00 00";

std::string ReadOf(std::uint8_t reg);

/// Makes a device with 120 holding registers from register 0 on.
config::Device Slave(const std::string& address);
config::Device Polled(const std::string& address, std::size_t points, Duration poll = 1s);
config::Line DriveLine(std::vector<config::Device> devices = {});

Bytes Damaged(Bytes frame);

struct RoutedLine : VirtualLine {
  struct Reply {
    std::string name;
    Instant at;
    RoutedReply reply;
  };

  /// Puts `slaves` on the wire that are not devices of `line`.
  explicit RoutedLine(config::Line line = DriveLine(),
                      const std::vector<std::string>& slaves = {"20", "21"});

  /// Puts `slaves` on the wire, which can be devices of `line` or not.
  RoutedLine(std::vector<config::Device> slaves, config::Line line);

  /// Sets register i of the simulated device to `base` + i.
  void Number(std::size_t twin, std::uint64_t base);

  void Ask(std::string name, const std::string& pdu, std::uint8_t slave = 20,
           std::uint64_t client = 1, config::Priority priority = config::Priority::normal,
           Duration within = 2500ms);

  std::vector<std::string> Names() const;
  const RoutedReply& Of(const std::string& name) const;
  /// Returns the requests on the wire so far: slave and PDU, without the CRC.
  std::vector<std::string> OnWire() const;

  std::vector<Reply> replies;
};

class BusyClients {
 public:
  explicit BusyClients(RoutedLine& line);

  void Add(const std::string& pdu, std::uint8_t slave,
           config::Priority priority = config::Priority::normal);
  int answered(std::size_t client) const { return clients_[client].answered; }
  int failed(std::size_t client) const { return clients_[client].failed; }

 private:
  struct Client {
    std::string pdu;
    std::uint8_t slave = 0;
    config::Priority priority = config::Priority::normal;
    int answered = 0;
    int failed = 0;
    bool waits = false;
  };

  void AskAgain();

  RoutedLine& line_;
  std::vector<Client> clients_;
};

}  // namespace baudgate::bus
