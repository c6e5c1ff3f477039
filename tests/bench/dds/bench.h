// Helpers of the benchmarks of the DDS library.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace baudgate::bench {

pid_t Start(const std::vector<std::string>& words);
void End(pid_t child, int signal);

double ProcessorOf(pid_t process);
/// Returns VmRSS in KiB.
long ResidentOf(pid_t process);

void RunImage();
void RunParticipants(const std::string& baudgate, int count);

int BeLateSubscriber(const std::vector<std::string>& words);
int BeSubscribers(const std::vector<std::string>& words);

}  // namespace baudgate::bench
