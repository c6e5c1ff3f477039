// Readers of the gateway's topics whose QoS asks for more than its writers offer. DDS gives them
// nothing and reports nothing. docs/dds.md, "What a reader may ask for", has the table.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>

#include <map>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/fast/inbox.h"

namespace baudgate::dds {

class UnmetReaders {
 public:
  /// A reader was found, has changed or has left. From any thread.
  void OnReader(const eprosima::fastrtps::rtps::ReaderDiscoveryInfo& info);
  /// A sentence for each; readers of one address that ask for the same share one.
  std::vector<std::string> Sentences() const;

 private:
  static constexpr std::size_t kMost = 256;

  mutable Mutex mutex_;
  std::map<Handle, std::string> readers_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::dds
