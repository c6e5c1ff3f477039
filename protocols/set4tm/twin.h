// A simulated SET-4TM: answers requests as a meter of its type does, with the values of a profile's
// points. Requests come from a simulator's pty, replies go back there.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/twin_points.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/points.h"
#include "protocols/set4tm/settings.h"
#include "protocols/set4tm/twin_address.h"
#include "protocols/set4tm/twin_clock.h"
#include "protocols/set4tm/twin_journals.h"
#include "protocols/set4tm/twin_load.h"
#include "protocols/twin.h"

namespace baudgate::protocols::set4tm {

class MeterTwin : public Twin {
 public:
  /// `values` outlives the twin.
  MeterTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;
  /// From then on it has a clock, and load profiles since a week before.
  void SetClock(Now now) override;
  bool Raise(const DeviceEvent& event, Now now) override;
  /// 1 to 3; null: it has no such profile, or no clock.
  TwinLoad* load(unsigned profile);

 private:
  /// The status byte, or the data; empty = silence.
  Bytes Serve(View pdu, Instant now);
  std::uint8_t Write(View pdu, Instant now);
  std::optional<Bytes> OfClock(View pdu, Instant now) const;
  /// Nothing when this meter has no such parameter.
  std::optional<Bytes> Data(View pdu, Instant now) const;
  std::optional<Bytes> OwnData(View pdu) const;
  std::optional<Bytes> Floats(View pdu, Instant now) const;
  std::optional<double> FloatOf(View pdu, std::uint8_t parameter, Instant now) const;
  void Latch(Instant now);
  /// Now, or when it was latched.
  Value Measured(View pdu, const TwinPoints<Field>::One& point, Instant now) const;
  bool Fill(View pdu, Instant now, Bytes& data) const;
  Scale ScaleNow(Instant now) const;

  const Settings settings_;
  TwinAddress address_;
  TwinClock clock_;
  TwinPoints<Field> points_;
  std::map<std::uint8_t, std::size_t> float_points_;  // index by RWRI parameter
  std::optional<std::uint8_t> type_;                  ///< empty: as its points say, else 8
  bool knows_floats_ = true;
  bool knows_masks_ = true;
  std::optional<Instant> last_correct_;  // of an open channel
  Instant latched_at_{};
  std::vector<Value> latched_;  // by point; empty: never
  std::map<unsigned, TwinLoad> loads_;
  TwinJournals journals_;
};

}  // namespace baudgate::protocols::set4tm
