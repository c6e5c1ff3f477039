// A configuration that may be given away: without the values of secrets, and without comments,
// which may have some as well.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// The names of all options that a protocol declares secret.
std::set<std::string> SecretKeys(const Catalog& catalog);

/// The same YAML with "***" in place of what follows a secret key, or a key that is likely
/// one misspelt, and of every copy of such a value. An error where it is no YAML, or grows without
/// end.
Result<std::string> MaskedConfig(const std::string& yaml, const std::set<std::string>& secrets);

}  // namespace baudgate::config
