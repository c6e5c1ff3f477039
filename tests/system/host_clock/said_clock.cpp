// Replaces ntp_adjtime() in the gateway (LD_PRELOAD) for meter_clock_test.cpp: the clock counts as
// synchronised if the file $SAID_CLOCK contains "right". Each answer is written to a file of the
// same name with ".told" appended. No clock is set.
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
