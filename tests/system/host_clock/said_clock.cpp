// Replaces ntp_adjtime() in the gateway (LD_PRELOAD) for tests/system/meter_clock_test.cpp: the
// host's clock counts as synchronised if the file $SAID_CLOCK contains "right". Each call writes
// the text that it has read to a second file with ".told" appended. No clock is set.
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
