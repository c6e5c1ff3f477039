// `baudgate profiles` lists device profiles, or the points of one profile. `baudgate profiles
// --check` checks a file, and `baudgate protocols` lists protocols.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "config/model/point.h"

namespace baudgate::tools {

// Returns the type of a point. Examples: "float32", "string(12)", "DT".

inline std::string TypeText(const config::Point& point) {
  if (point.time_type != config::TimeType::none) return config::IecName(point);
  std::string text(config::Name(point.type));
  if (point.type == config::Type::string) text += "(" + std::to_string(point.text_length) + ")";
  return text;
}

/// Prints one protocol or, if `name` is empty, the list of protocols. Exit codes: 0 done; 2 unknown
/// protocol; 4 no protocol is installed.
int RunProtocols(const std::string& name, bool json, const config::Catalog& catalog,
                 std::ostream& out, std::ostream& err);

enum class ProfileFormat : std::uint8_t { table, json, markdown };

/// Prints the profile `name` ("spaj140c" or "spabus/spaj140c") or, if `name` is empty, the list of
/// profiles. Tables are at most `width` characters wide; 0: no limit. Exit codes: 0 done; 2 unknown
/// profile, or several have this name; 3 the profile has errors; 4 no protocol is installed.
int RunProfiles(const std::string& name, ProfileFormat format, const config::Catalog& catalog,
                std::ostream& out, std::ostream& err, std::size_t width = 0);

// `baudgate profiles --check FILE`: prints all problems of a profile, or its points if it has none.
struct CheckProfileOptions {
  std::string file;
  /// Empty: the protocol after which the file's folder is named, or else the protocol with the
  /// fewest errors.
  std::string protocol{};
  ProfileFormat format = ProfileFormat::table;
  std::size_t width = 0;
};

/// Exit codes: 0 the profile can be used, even with warnings; 2 unknown protocol; 3 the profile has
/// errors; 4 the file cannot be read, or no protocol is installed.
int RunCheckProfile(const CheckProfileOptions& options, const config::Catalog& catalog,
                    std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
