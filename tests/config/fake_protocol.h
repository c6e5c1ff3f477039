// Descriptors that speak nothing: options, checks and profiles for the loader's tests, so that
// those depend on no real protocol.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/catalog/catalog.h"
#include "config/loader.h"

namespace baudgate::testing {

/// `name` must be a literal. Addresses are 1…99; `read` is 'A' and a number.
protocols::Protocol MakeFakeProtocol(std::string_view name);
/// The same, and it carries Modbus.
protocols::Protocol MakeFakeCarrier(std::string_view name);

/// The protocol "fake" (options: checksum, width, ratio, mode, password, pause, tags; of the line:
/// broadcast) and the profiles under tests/config/profiles.
const config::Catalog& FakeCatalog();

/// Fakes named "modbus_ascii" and "modbus_rtu", which carry Modbus, beside "fake".
const config::Catalog& ModbusCatalog();

/// What is written, and what is said of it.
struct Case {
  const char* keys;
  const char* problem;
};

/// All problems as they are printed, one a line.
std::string Shown(const std::vector<config::Problem>& problems);

/// A configuration whose first line is `lines:`, so that line and column are easy to count.
config::Loaded Load(const std::string& text);
/// The same with ModbusCatalog.
config::Loaded LoadModbus(const std::string& text);

/// The problems of a configuration with one line and one device. `device` is put into the device's
/// flow map behind "{ name: d, address: 1": in line 6, from column 31 on.
std::string ProblemsOfDevice(const std::string& device);

/// The problems of a device whose only point is { `point` }: in line 8, from column 13 on.
std::string ProblemsOfPoint(const std::string& point);

}  // namespace baudgate::testing
