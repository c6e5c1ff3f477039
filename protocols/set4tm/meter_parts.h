// What is known of one meter, and the jobs on it: the parts that its conversation joins
// (conversation.h). What is asked is in requests.h, what follows from replies in replies.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/common/try_again.h"
#include "protocols/protocol.h"
#include "protocols/set4tm/archive.h"
#include "protocols/set4tm/clock_drift.h"
#include "protocols/set4tm/identification.h"
#include "protocols/set4tm/latched_reads.h"
#include "protocols/set4tm/point_reads.h"
#include "protocols/set4tm/session.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {

struct MeterParts {
  /// `device` and `bus` outlive it.
  MeterParts(const config::Device& its_device, const Settings& its_settings, MeterBus& bus)
      : device(its_device),
        settings(its_settings),
        identification(device, settings),
        reads(device, settings, identification),
        latched(settings.latch, bus.latch),
        archive(device.events, settings, identification),
        session(settings) {}

  const config::Device& device;
  /// Lets everything that the meter has refused be asked again, except points. `journals`: see
  /// MeterArchive.
  void ForgetRefusals(bool journals) {
    identification.ForgetRefusals();
    archive.ForgetRefusals(journals);
    latched.ForgetRefusals();
    reads.TryMasks();
  }

  const Settings settings;
  TryAgain refused;  ///< requests that read no point: constants, masks, load profiles
  Identification identification;
  PointReads reads;
  ClockDrift drift;
  LatchedReads latched;
  MeterArchive archive;
  MeterSession session;
};

}  // namespace baudgate::protocols::set4tm
