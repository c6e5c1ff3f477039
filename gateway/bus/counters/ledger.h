// All that the status shows of a line: its own account, those of its devices, their states, and how
// long their fast rounds take.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/bus/counters/device_accounts.h"
#include "gateway/bus/counters/device_states.h"
#include "gateway/bus/counters/fast_rounds.h"
#include "gateway/bus/counters/line_account.h"

namespace baudgate {

struct Ledger {
  /// `line_index`: in the store. All references outlive it.
  Ledger(const Roster& roster, const Schedule& schedule, PointStore& store,
         std::uint32_t line_index, PollerListener& listener)
      : line(store, line_index, listener),
        devices(roster, schedule, store, listener),
        states(roster, store, listener),
        rounds(roster, store) {}

  /// Time has passed; `busy`: the line was busy, with `member` if that is known. `drains`: it kept
  /// silence after an exchange of that member.
  void OnTime(Now now, bool busy, const Member* member, bool drains = false) {
    const Duration took = line.OnTime(now, busy, drains);
    devices.OnTime(now, member, took, drains);
    states.OnTime(now);
  }
  /// The port has opened.
  void OnOpened() {
    line.OnOpened();
    devices.OnOpened();
    states.OnOpened();
  }
  void OnClosed(Override why) {
    line.OnClosed();
    states.OnClosed(why);
  }
  void Attach(Tap& tap) {
    line.Attach(tap);
    states.Attach(tap);
  }

  LineAccount line;
  DeviceAccounts devices;
  DeviceStates states;
  FastRounds rounds;
};

}  // namespace baudgate
