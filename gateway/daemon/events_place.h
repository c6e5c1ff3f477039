// Where events.db is, for the parts that write to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "gateway/records/disk/events_writer.h"

namespace baudgate {

struct EventsPlace {
  std::filesystem::path file;  ///< empty: there is no place for it
  std::string why_no_file{};
  bool in_memory = false;  ///< only the gateway's own alarms, until it ends
  std::shared_ptr<EventsWriter> writer = std::make_shared<EventsWriter>();
};

}  // namespace baudgate
