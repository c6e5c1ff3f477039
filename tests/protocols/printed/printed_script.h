// Exchanges as a protocol's reference prints them, and what `baudgate decode` has to make of them.
//
//   # comment
//   set: checksum=true width=0       options from here on; the device forgets what it has learned
//   > #01                            a request, without check value and line end: dcon and spabus
//                                    as text, the others as hex
//   < >+100.23+34.050                its reply; none: nobody answers
//   = #[0] = 100.23                  a value, as label = value
//   = #[1] = [bad]                   one that is not good: [bad] or [uncertain]
//   ! refused                        the outcome, where it is not ok
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/outcome.h"

namespace baudgate::protocols {

struct PrintedExchange {
  int line = 0;  ///< of the request
  std::string request;
  std::optional<std::string> reply;
  std::vector<std::string> values;
  std::string outcome = "ok";
};

struct PrintedPart {
  std::vector<std::pair<std::string, std::string>> options;
  std::vector<PrintedExchange> exchanges;
};

/// Every line that cannot be read is a failure of the test.
std::vector<PrintedPart> ReadPrintedScript(const std::string& path);

}  // namespace baudgate::protocols
