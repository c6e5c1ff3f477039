// What processes that were killed leave of Fast DDS's shared memory in /dev/shm: 8 MiB each with
// the gateway's settings. Called before a participant with shared memory is made.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>

#include "gateway/base/time.h"

namespace baudgate::dds {

/// Removes segments and ports of our own user whose owner has ended: their lock files, which the
/// library holds as long as it runs, are free. A lock file younger than this belongs to somebody
/// who may be about to lock it.
inline constexpr Duration kLockTaken = 200ms;

/// Returns how many files went.
std::size_t RemoveSharedMemoryRest(const std::filesystem::path& directory = "/dev/shm");

}  // namespace baudgate::dds
