// A request by HTTP as one of the control socket, and its answer the way back: what both can tell
// is made in one place (gateway/outputs/control).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "gateway/base/result.h"
#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// A member of the request that is taken from the address, where it is there.
struct Part {
  const char* query;
  bool number = false;
  const char* member = nullptr;  ///< null: as in the address
};

/// The error names a number that is none, or a member that there is not.
Result<control::Json> AskOf(const Request& request, std::string_view command,
                            std::initializer_list<Part> parts);

Response JsonResponse(const control::Json& json);

/// What the control socket would say, with the status that belongs to it.
Response ResponseOf(std::string answer);

/// Nothing can be written through it.
class NoWrites final : public CommandSink {
 public:
  bool Submit(WriteCommand) override { return false; }
};

}  // namespace baudgate::web
