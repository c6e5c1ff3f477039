// What the DDS process gives up at its start, before any other thread and any call of the library:
// a datagram that takes it over must not get far. Under systemd its unit does the same and more.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>

#include "gateway/base/result.h"

namespace baudgate::dds {

/// A sanitizer needs the address space and the calls that are taken away here.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// SIGTERM when `parent` dies. False: it is dead already.
bool EndWith(pid_t parent);

/// Address space in bytes; no core files.
Status LimitMemory(std::uint64_t bytes);

/// From now on: no new programs, no tracing of others, no signals to others, no mounts, no local
/// sockets, no new namespaces, no kernel modules, nor what else exploits like. Such calls fail with
/// EPERM.
Status DenyCalls();

}  // namespace baudgate::dds
