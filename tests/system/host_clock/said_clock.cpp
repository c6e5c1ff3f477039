// Preloaded into the gateway by meter_clock_test.cpp: what the kernel says of its clock is what the
// file $SAID_CLOCK says, "right" or anything else. What was said last stands in that file's
// neighbour, with ".told" behind its name. Nothing is set.
// SPDX-License-Identifier: Apache-2.0
#include <sys/timex.h>

#include <cstdlib>
#include <fstream>
#include <string>

extern "C" int ntp_adjtime(timex* state) noexcept {
  const char* const file = std::getenv("SAID_CLOCK");
  const std::string name = file == nullptr ? "" : file;
  std::string said;
  std::ifstream(name) >> said;
  std::ofstream(name + ".told") << said;
  const bool right = said == "right";
  state->status = right ? 0 : STA_UNSYNC;
  return right ? TIME_OK : TIME_ERROR;
}
