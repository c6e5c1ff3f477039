// MeterTwin simulates a SET-4TM meter. It answers requests as a meter of its type does, with the
// values of a profile's points. TwinAddress and TwinClock are its addresses and its clock.
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

// The addresses of a simulated meter: the short address, the extended address (its serial number),
// and the configured address.
class TwinAddress {
 public:
  /// `configured`: the configured address; if it is extended, the meter has a short address as
  /// well. `serial`: the configured serial number; empty or 0: the number is that of the extended
  /// address, or a default.
  TwinAddress(Bytes configured, std::optional<std::uint32_t> serial);

  bool Hears(View address) const;
  /// True if `address` is the common address 0 and the meter's own short address is another.
  bool IsCommon(View address) const;
  View ReplyTo(View address) const;
  void ReplyAs(Bytes address) { reply_as_ = std::move(address); }

  std::uint8_t short_address() const { return own_[0]; }
  std::uint32_t serial() const { return serial_; }

 private:
  const Bytes configured_;
  Bytes own_;  // the short address
  // Address of all replies; empty: the requested address, or the short address for 0.
  Bytes reply_as_;
  std::uint32_t serial_ = 0;
};

// The clock of a simulated meter: this machine's clock plus the corrections.
class TwinClock {
 public:
  explicit TwinClock(const CivilZone& zone) : zone_(zone) {}

  void Set(Now now) { set_ = now; }
  std::optional<CivilZone::Utc> At(Instant now) const;
  /// Corrects the clock and returns the status. Access level 1 allows one correction a day, by at
  /// most two minutes, and only within the present hour.
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
  MeterTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;
  /// Starts the clock, and load profiles that begin a week before `now`.
  void SetClock(Now now) override;
  bool Raise(const DeviceEvent& event, Now now) override;
  /// Returns the load profile with this number, 1 to 3. Null: the meter has no such profile, or no
  /// clock.
  TwinLoad* load(unsigned profile);

 private:
  /// Returns the content of the reply: a status byte, or data.
  Bytes Serve(View pdu, Instant now);
  std::uint8_t Write(View pdu, Instant now);
  std::optional<Bytes> OfClock(View pdu, Instant now) const;
  /// Returns the data for a read. Empty: this meter does not have the parameter.
  std::optional<Bytes> Data(View pdu, Instant now) const;
  std::optional<Bytes> OwnData(View pdu) const;
  std::optional<Bytes> Floats(View pdu, Instant now) const;
  std::optional<double> FloatOf(View pdu, std::uint8_t parameter, Instant now) const;
  void Latch(Instant now);
  /// Returns the present value of a point, or its latched value if `pdu` reads latched values.
  Value Measured(View pdu, const TwinPoints<Field>::One& point, Instant now) const;
  bool Fill(View pdu, Instant now, Bytes& data) const;
  Scale ScaleNow(Instant now) const;

  const Settings settings_;
  TwinAddress address_;
  TwinClock clock_;
  TwinPoints<Field> points_;
  // Key: RWRI parameter; value: index of the point.
  std::map<std::uint8_t, std::size_t> float_points_;
  std::optional<std::uint8_t> type_;  ///< type code; empty: the points define it, else it is 8
  bool knows_floats_ = true;
  bool knows_masks_ = true;
  std::optional<Instant> last_correct_;  // time of the last request while the channel was open
  Instant latched_at_{};
  std::vector<Value> latched_;  // latched values, index: point; empty: there was no latch yet
  std::map<unsigned, TwinLoad> loads_;
  TwinJournals journals_;
};

}  // namespace baudgate::protocols::set4tm
