// Functions for the file descriptors of the process: how many the gateway needs, and how many
// clients and viewers can connect if the system allows fewer. Ports, sockets and files come first;
// viewers of the web page get at most an eighth of the limit, and clients the rest. `OpenFiles`
// counts the open descriptors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dirent.h>

#include <cstddef>
#include <memory>
#include <string>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/daemon/output_list.h"

namespace baudgate::daemon {

/// Returns how many files the gateway, its lines and these outputs can have open at once.
outputs::DescriptorNeeds DescriptorNeedsOf(const config::Config& config, const OutputRows& outputs);

/// Raises the soft limit of this process towards `needed`, as far as the hard limit allows; never
/// lowers it. Returns the resulting limit.
std::size_t RaiseDescriptorLimit(std::size_t needed);

/// Returns the share of `needs.clients` that is allowed to connect, above 0 and at most 1.
double ClientShare(const outputs::DescriptorNeeds& needs, std::size_t limit);

/// Returns how many of `needs.viewers` are allowed: all, or at most an eighth of the limit.
std::size_t ViewerShare(const outputs::DescriptorNeeds& needs, std::size_t limit);

std::string ExplainClientShare(const outputs::DescriptorNeeds& needs, std::size_t limit);

/// Counts the open files of this process, even when the process has reached its limit. Thread-safe.
class OpenFiles {
 public:
  OpenFiles();

  struct Count {
    std::size_t open = 0;
    std::size_t limit = 0;  ///< 0: no limit, or unknown
  };
  Count Now();

 private:
  struct Closer {
    void operator()(DIR* folder) const { ::closedir(folder); }
  };
  Mutex mutex_;
  // The folder /proc/self/fd, opened at the start; null: the folder cannot be read.
  std::unique_ptr<DIR, Closer> folder_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::daemon
