// `baudgate profiles [NAME]`: the installed device profiles, and every point of one of them with
// its register, table, type and unit. Files come through config/loader; tables go to the caller's
// streams. RunProtocols is `baudgate protocols`, and RunCheckProfile `baudgate profiles --check`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "config/model/point.h"

namespace baudgate::tools {

// "float32", "string(12)", "DT".

inline std::string TypeText(const config::Point& point) {
  if (point.time_type != config::TimeType::none) return config::IecName(point);
  std::string text(config::Name(point.type));
  if (point.type == config::Type::string) text += "(" + std::to_string(point.text_length) + ")";
  return text;
}

// `baudgate protocols [NAME]`: what is installed, and the options and decoders of one protocol.
// Descriptors come from the catalog; text or JSON goes to the streams of the caller.

/// An empty name lists all. Exit codes: 0 done, 2 no such protocol.
int RunProtocols(const std::string& name, bool json, const config::Catalog& catalog,
                 std::ostream& out, std::ostream& err);

enum class ProfileFormat : std::uint8_t { table, json, markdown };

/// `name`: "spaj140c", "spabus/spaj140c", or empty for the list. Exit codes: 0 done, 2 no such
/// profile or several of that name, 3 the profile is bad (its problems go to `err`). `width` of
/// tables, characters a line; 0: no limit.
int RunProfiles(const std::string& name, ProfileFormat format, const config::Catalog& catalog,
                std::ostream& out, std::ostream& err, std::size_t width = 0);

// `baudgate profiles --check FILE`: all that is wrong with a profile, or its register table.
struct CheckProfileOptions {
  std::string file;
  std::string protocol{};  ///< empty: that of its folder, or the one that it fits best
  ProfileFormat format = ProfileFormat::table;
  std::size_t width = 0;
};

/// Exit codes: 0 it can be used, warnings included; 2 no such protocol; 3 it is bad; 4 it cannot
/// be read.
int RunCheckProfile(const CheckProfileOptions& options, const config::Catalog& catalog,
                    std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
