// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/trace_stream.h"

#include "gateway/outputs/control/line_requests.h"

namespace baudgate::control {

std::string TraceStream::Take() {
  std::string text;
  for (const TraceRecord& record : queue_->Take()) {
    if (!Wanted(wish_, record)) continue;
    if (!text.empty()) text += '\n';
    text += RecordLine(record);
  }
  return text;
}

}  // namespace baudgate::control
