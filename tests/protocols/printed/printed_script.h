// Reads scripts of exchanges that are printed in the reference of a protocol, with the expected
// output of `baudgate decode`.
//
//   # comment
//   set: checksum=true width=0       options from here on; the state of the device is cleared
//   > #01                            a request, without check value and line end: dcon and spabus
//                                    as text, the others as hex
//   < >+100.23+34.050                its reply; without this line: silence
//   = #[0] = 100.23                  a value, as label = value
//   = #[1] = [bad]                   a value that is not good: [bad] or [uncertain]
//   ! refused                        the outcome, if it is not ok
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/outcome.h"

namespace baudgate::protocols {

struct PrintedExchange {
  int line = 0;
  std::string request;
  std::optional<std::string> reply;
  std::vector<std::string> values;
  std::string outcome = "ok";
};

struct PrintedPart {
  std::vector<std::pair<std::string, std::string>> options;
  std::vector<PrintedExchange> exchanges;
};

std::vector<PrintedPart> ReadPrintedScript(const std::string& path);

}  // namespace baudgate::protocols
