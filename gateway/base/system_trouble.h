// What a failed call of the system means for users, and what helps.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace baudgate {

/// Of errno. "too many open files; raise LimitNOFILE of the service (ulimit -Hn)".
std::string SystemTrouble(int error);

/// This process may open no file more.
bool NoFileLeft();

/// The bytes that a file of this process may have. Nothing: as many as it likes.
std::optional<std::size_t> MostFileBytes();

}  // namespace baudgate
