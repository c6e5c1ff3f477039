// Preloaded into the gateway by meter_clock_test.cpp: what the kernel says of its clock is what
// $SAID_CLOCK says, "right" or anything else. Nothing is set.
// SPDX-License-Identifier: Apache-2.0
#include <sys/timex.h>

#include <cstdlib>
#include <string_view>

extern "C" int ntp_adjtime(timex* state) noexcept {
  const char* const said = std::getenv("SAID_CLOCK");
  const bool right = said != nullptr && std::string_view(said) == "right";
  state->status = right ? 0 : STA_UNSYNC;
  return right ? TIME_OK : TIME_ERROR;
}
