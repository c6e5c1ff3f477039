// What the benches of the DDS library share: processes of the same program, and what they used.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace baudgate::bench {

/// This program again: `baudgate_dds_bench ROLE ARGS…`. Ends with us.
pid_t Start(const std::vector<std::string>& words);
void End(pid_t child, int signal);

/// Seconds of processor, so far.
double ProcessorOf(pid_t process);
/// VmRSS, in KiB.
long ResidentOf(pid_t process);

void RunImage();
void RunParticipants(const std::string& baudgate, int count);

int BeLateSubscriber(const std::vector<std::string>& words);
int BeSubscribers(const std::vector<std::string>& words);

}  // namespace baudgate::bench
