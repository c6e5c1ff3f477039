// `baudgate history --billing`: billing readings of meters as a table, one row a reading and
// tariff.
//
//   meter      reading  date        tariff  import kWh  export kWh  …  quality
//   meters.m1  month    2026-11-01  all     1500.25     0
//   meters.m1  month    2026-11-01  1       1000.25     0
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>

#include "gateway/tools/cli/client/history.h"

namespace baudgate {

/// `options.points` are LINE.DEVICE. Days count by the meter's date, `until` is the first that is
/// not wanted. Exit codes as of RunHistory.
int RunBilling(const HistoryOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
