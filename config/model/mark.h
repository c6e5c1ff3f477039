// Where something of the configuration stands in its file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace baudgate::config {

/// Where something stands in a file, for messages: "file:line:column". Line 0 = not from a file.
struct Mark {
  std::string file;
  int line = 0;
  int column = 0;

  std::string ToString() const;
};

}  // namespace baudgate::config
