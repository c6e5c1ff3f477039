// `baudgate profiles --new FROM.csv`: a profile from a device's register list. ListedExample is the
// example of a list, as the twin shows it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/base/decimal.h"
#include "gateway/base/result.h"
#include "gateway/tools/cli/offline/register_list.h"

namespace baudgate {

// The example of a register list, as the twin of the device shows it.

/// "0.1", "0,1", "1E-05".
std::optional<Decimal> ListedNumber(const std::string& text);

/// The raw value behind `simulate:`, as YAML has it: "2304" of "230,4" at a scale of 0.1,
/// 1795737600 of "2026-11-27" where the form is DATE. `form`: what the registers hold. The error
/// says why they cannot hold it.
Result<std::string> ListedExample(const std::string& text, const std::string& form,
                                  const Decimal& scale);

struct NewProfileOptions {
  std::string file;
  std::optional<FirstRegister> first{};
  std::string table = "holding";  ///< of numbers that tell none
  std::string title{};            ///< `device:`; empty: the file's name
};

/// The profile goes to `out`, or nothing does. Exit codes: 0 done, 2 it is not said what the first
/// register is called, 3 the list has errors (all go to `err`), 4 it cannot be read.
int RunNewProfile(const NewProfileOptions& options, const config::Catalog& catalog,
                  std::ostream& out, std::ostream& err);

}  // namespace baudgate
