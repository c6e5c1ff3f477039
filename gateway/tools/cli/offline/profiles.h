// `baudgate profiles [NAME]`: the installed device profiles, and every point of one of them with
// its register, table, type and unit. Files come through config/loader; tables go to the caller's
// streams.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"

namespace baudgate {

enum class ProfileFormat : std::uint8_t { table, json, markdown };

/// Its title, and every point with its register.
void PrintProfile(const config::Profile& profile, ProfileFormat format, std::size_t width,
                  std::ostream& out);

/// `name`: "spaj140c", "spabus/spaj140c", or empty for the list. Exit codes: 0 done, 2 no such
/// profile or several of that name, 3 the profile is bad (its problems go to `err`). `width` of
/// tables, characters a line; 0: no limit.
int RunProfiles(const std::string& name, ProfileFormat format, const config::Catalog& catalog,
                std::ostream& out, std::ostream& err, std::size_t width = 0);

}  // namespace baudgate
