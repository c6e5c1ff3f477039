// File descriptors: how many the gateway needs by its configuration, and how many clients and
// viewers may connect if the system allows fewer. Ports, sockets and files come first; viewers get
// at most an eighth of the limit, and clients what is left.
// OpenFiles counts the descriptors that are open.
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

/// The files that the gateway, its lines and these outputs may have open at once.
outputs::DescriptorNeeds DescriptorNeedsOf(const config::Config& config, const OutputRows& outputs);

/// Raises this process's soft limit towards `needed`, as far as the hard one allows; never lowers
/// it. Returns the new limit.
std::size_t RaiseDescriptorLimit(std::size_t needed);

/// Which part of `needs.clients` may connect, above 0 and at most 1.
double ClientShare(const outputs::DescriptorNeeds& needs, std::size_t limit);

/// How many of `needs.viewers` may be used: all, or an eighth of the limit.
std::size_t ViewerShare(const outputs::DescriptorNeeds& needs, std::size_t limit);

/// For the log, if it is less than all.
std::string ExplainClientShare(const outputs::DescriptorNeeds& needs, std::size_t limit);

/// Counts the files that this process has open, also at its limit. From any thread.
class OpenFiles {
 public:
  OpenFiles();

  struct Count {
    std::size_t open = 0;
    std::size_t limit = 0;  ///< 0: there is none, or it is not known
  };
  Count Now();

 private:
  struct Closer {
    void operator()(DIR* folder) const { ::closedir(folder); }
  };
  Mutex mutex_;
  std::unique_ptr<DIR, Closer> folder_ BAUDGATE_GUARDED_BY(mutex_);  // null: it cannot be read
};

}  // namespace baudgate::daemon
