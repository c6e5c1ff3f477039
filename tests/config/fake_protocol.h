// Protocol descriptors without communication: options, checks and profiles, so that the loader's
// tests depend on no real protocol.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/catalog/catalog.h"
#include "config/loader.h"

namespace baudgate::testing {

/// `name` must be a literal. Addresses are 1…99; `read` is 'A' and a number.
protocols::Protocol MakeFakeProtocol(std::string_view name);
/// Makes the same protocol as a carrier of Modbus.
protocols::Protocol MakeFakeCarrier(std::string_view name);

/// Returns the protocol "fake" (options: checksum, width, ratio, mode, password, pause, tags; of
/// the line: broadcast) and the profiles in tests/config/profiles.
const config::Catalog& FakeCatalog();

/// Returns "fake" and fakes of "modbus_ascii" and "modbus_rtu", which carry Modbus.
const config::Catalog& ModbusCatalog();

struct Case {
  const char* keys;
  const char* problem;
};

std::string Shown(const std::vector<config::Problem>& problems);

/// The text should begin with `lines:`, so that line and column are easy to count.
config::Loaded Load(const std::string& text);
config::Loaded LoadModbus(const std::string& text);

/// Returns the problems of a configuration with one line and one device. `device` is inserted
/// behind "{ name: d, address: 1": in line 6, from column 31 on.
std::string ProblemsOfDevice(const std::string& device);

/// Returns the problems of a device whose only point is { `point` }: in line 8, from column 13 on.
std::string ProblemsOfPoint(const std::string& point);

}  // namespace baudgate::testing
