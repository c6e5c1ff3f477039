// Protocol descriptors without communication: options, checks and profiles for tests of the loader.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/catalog/catalog.h"
#include "config/loader.h"

namespace baudgate::testing {

protocols::Protocol MakeFakeProtocol(std::string_view name);
protocols::Protocol MakeFakeCarrier(std::string_view name);

/// Returns the protocol "fake" (options: checksum, width, ratio, mode, password, pause, tags; of
/// the line: broadcast) and the profiles in tests/config/profiles.
const config::Catalog& FakeCatalog();

const config::Catalog& ModbusCatalog();

struct Case {
  const char* keys;
  const char* problem;
};

std::string Shown(const std::vector<config::Problem>& problems);

config::Loaded Load(const std::string& text);
config::Loaded LoadModbus(const std::string& text);

/// Returns the problems of a configuration with one line and one device. The keys in `device` are
/// inserted behind "{ name: d, address: 1": in line 6, from column 31 on.
std::string ProblemsOfDevice(const std::string& device);

/// Returns the problems of a device whose only point has the keys in `point`: in line 8, from
/// column 13 on.
std::string ProblemsOfPoint(const std::string& point);

}  // namespace baudgate::testing
