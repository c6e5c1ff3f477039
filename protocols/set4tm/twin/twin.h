// A simulated SET-4TM: answers requests as a meter of its type does, with the values of a profile's
// points. Requests come from a simulator's pty, replies go back there. TwinAddress and TwinClock
// are the addresses and the clock of the twin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/common/clock.h"
#include "protocols/common/twin_points.h"
#include "protocols/set4tm/meter/points.h"
#include "protocols/set4tm/meter/settings.h"
#include "protocols/set4tm/twin/twin_archive.h"
#include "protocols/twin.h"

namespace baudgate::protocols::set4tm {

// The addresses of a simulated meter: the short one, the extended one of its serial number, and the
// one at which it is configured.
class TwinAddress {
 public:
  /// A meter that is configured at its extended address has a short one as well. `serial`: of the
  /// configuration; empty or 0: that of an extended address, or any.
  TwinAddress(Bytes configured, std::optional<std::uint32_t> serial);

  bool Hears(View address) const;
  /// The request came to the common address, and the meter has another one.
  bool IsCommon(View address) const;
  /// The address in the reply to a request that came to `address`.
  View ReplyTo(View address) const;
  /// From then on all replies have this one.
  void ReplyAs(Bytes address) { reply_as_ = std::move(address); }

  std::uint8_t short_address() const { return own_[0]; }
  std::uint32_t serial() const { return serial_; }

 private:
  const Bytes configured_;
  Bytes own_;       // the short one
  Bytes reply_as_;  // empty: the address by which it was asked, the short one for 0
  std::uint32_t serial_ = 0;
};

// The clock of a simulated meter: that of this machine, and what it was corrected by.
class TwinClock {
 public:
  explicit TwinClock(const CivilZone& zone) : zone_(zone) {}

  void Set(Now now) { set_ = now; }
  /// What it shows; empty: it was never set.
  std::optional<CivilZone::Utc> At(Instant now) const;
  /// Returns the status: level 1 may correct it by up to two minutes, once a day, within an hour.
  std::uint8_t Correct(std::chrono::seconds by, Instant now);

  const CivilZone& zone() const { return zone_; }

 private:
  const CivilZone zone_;
  std::optional<Now> set_;
  std::chrono::seconds correction_{};
  std::optional<std::chrono::local_days> corrected_on_;
};

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
