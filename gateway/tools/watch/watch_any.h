// `baudgate watch --any`: samples of every topic whose type is announced, one line each.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/outputs/dds/fast/any_subscriber.h"
#include "gateway/tools/watch/watch.h"

namespace baudgate {

/// Ends at SIGINT and SIGTERM, or after `seconds`. Returns the exit code.
int RunWatchAny(const WatchOptions& options, std::ostream& out, std::ostream& err);

/// "rt/chatter  data=hello  count=3"
std::string PlainLine(const dds::AnySample& sample);
/// {"topic":"rt/chatter","type":"…","data":"hello","count":3}
std::string JsonLine(const dds::AnySample& sample);

}  // namespace baudgate
