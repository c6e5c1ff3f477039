// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/clocks/clock_corrector.h"

#include <fmt/format.h>
#include <sys/timex.h>
#include <systemd/sd-bus.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::daemon {
namespace {

constexpr Duration kLookInterval = 1s;
constexpr Duration kAnswerPatience = 30s;
/// The maximum age of the second reading of the drift.
constexpr Duration kFresh = 10s;
/// Two readings of a drift agree if they differ by at most this number of seconds.
constexpr double kAlike = 2;

const bus::Writer kWriter{"gateway", 0};
constexpr std::string_view kTried = "tried ";

std::chrono::seconds UnixTime(WallTime at) {
  return std::chrono::floor<std::chrono::seconds>(at).time_since_epoch();
}

/// Parses "tried 1790000000", the time of the last try in seconds since 1970.
std::optional<std::chrono::seconds> TriedAt(const std::string& memory) {
  if (!memory.starts_with(kTried)) return std::nullopt;
  const auto at = ParseInteger<std::int64_t>(std::string_view(memory).substr(kTried.size()));
  return at ? std::optional(std::chrono::seconds(*at)) : std::nullopt;
}

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

std::string Shown(double drift) {
  return fmt::format("{:.1f} s {}", std::abs(drift), drift > 0 ? "ahead" : "behind");
}

bool WantsCare(const config::Config& config) {
  return std::ranges::any_of(config.lines, [](const config::Line& line) {
    return std::ranges::any_of(line.devices, [](const config::Device& device) {
      return protocols::ClockCareOf(device).has_value();
    });
  });
}

std::uint32_t DevicesOf(const config::Config& config) {
  std::size_t devices = 0;
  for (const config::Line& line : config.lines) devices += line.devices.size();
  return static_cast<std::uint32_t>(devices);
}

}  // namespace

ClockCorrector::ClockCorrector(Links links)
    : links_(std::move(links)), gate_(links_.store, links_.commands) {}

void ClockCorrector::OnReload(const config::Config& config) {
  const MutexLock lock(mutex_);
  devices_ = DevicesOf(config);
  if (tries_) {
    tries_->OnReload(config);
  } else if (WantsCare(config)) {
    if (links_.open) {
      tries_ = links_.open(config);
    } else {
      links_.warn(
          "no device clock is corrected, because the gateway has no folder to save the times of "
          "its attempts. Set gateway.state");
    }
  }
}

void ClockCorrector::OnHostClock(bool right) {
  const MutexLock lock(mutex_);
  right_ = right;
}

void ClockCorrector::Stop() {
  const MutexLock lock(mutex_);
  stopped_ = true;
}

void ClockCorrector::Tick(Now now) {
  const MutexLock lock(mutex_);
  if (stopped_ || !tries_ || (looked_ && now.instant - *looked_ < kLookInterval)) return;
  looked_ = now.instant;
  for (std::uint32_t device = 0; device < devices_; ++device) {
    // A device that a reload has removed is still checked until its correction has been reported.
    if (links_.store.gone(device) && !under_way_.contains(device)) continue;
    const auto its = links_.store.device(device);
    const auto care = its ? protocols::ClockCareOf(*its) : std::nullopt;
    if (care) Look(device, *care, now);
  }
}

void ClockCorrector::Look(std::uint32_t device, const protocols::ClockCare& care, Now now) {
  if (under_way_.contains(device)) {
    GoOn(device, care, now);
  } else if (MayTry(device, care, now)) {
    Begin(device, care, now);
  }
}

bool ClockCorrector::MayTry(std::uint32_t device, const protocols::ClockCare& care, Now now) const {
  if (!right_ || !MayCorrectAt(now.wall, care.zone)) return false;
  const auto tried = TriedAt(tries_->Of(device));
  if (tried && UnixTime(now.wall) - *tried < kBetweenTries) return false;
  const auto wait = not_before_.find(device);
  return wait == not_before_.end() || now.instant >= wait->second;
}

std::optional<double> ClockCorrector::DriftOf(std::uint32_t device,
                                              const protocols::ClockCare& care, Instant now) const {
  std::optional<double> drift;
  links_.store.Read(device, [&](const bus::DeviceRecord& record) {
    if (!IsGood(QualityAt(record, care.drift, now))) return;
    drift = ToDouble(record.points[care.drift].value);
  });
  return drift && std::isfinite(*drift) ? drift : std::nullopt;
}

void ClockCorrector::Begin(std::uint32_t device, const protocols::ClockCare& care, Now now) {
  const auto drift = DriftOf(device, care, now.instant);
  if (!drift || std::abs(*drift) < Seconds(care.least)) return;
  UnderWay& begun = under_way_[device];
  begun.held = links_.store.Hold(device);
  begun.drift = *drift;
  bus::WriteCommand command;
  command.device = device;
  command.client = kWriter.name;
  command.kind = bus::Reads{{care.drift}};
  command.deadline = now.instant + kAnswerPatience;
  command.done = [answered = begun.answered](const WriteResult& result) {
    const MutexLock lock(answered->mutex);
    answered->result = result;
  };
  if (links_.commands.Submit(std::move(command))) return;
  under_way_.erase(device);
  not_before_[device] = now.instant + kBetweenReads;
}

void ClockCorrector::GoOn(std::uint32_t device, const protocols::ClockCare& care, Now now) {
  using Step = UnderWay::Step;
  const UnderWay was = under_way_.at(device);
  const bool gone = links_.store.gone(device);
  if (was.step == Step::keeps) {
    const auto kept = tries_->kept();
    if (kept == records::DeviceMemory::Kept::waits) return;
    under_way_.erase(device);
    const char* why = nullptr;
    if (gone) why = "a reload has changed or removed the line of the device";
    if (!right_)
      why = "this machine's clock is no longer synchronised; check its time service (timedatectl)";
    if (kept == records::DeviceMemory::Kept::no)
      why = "the attempt cannot be saved, because the disk fails; check the disk (dmesg)";
    if (why == nullptr) return Correct(device, care, was.drift, now);
    return links_.tell(device, false, "it is " + Shown(was.drift) + "; " + why, now);
  }
  std::optional<WriteResult> result;
  {
    const MutexLock lock(was.answered->mutex);
    result = was.answered->result;
  }
  if (!result) return;
  under_way_.erase(device);
  if (was.step == Step::writes) return TellEnd(device, was.drift, *result, now);
  not_before_[device] = now.instant + kBetweenReads;
  if (result->read_back && !gone) Keep(device, care, was.drift, now);
}

void ClockCorrector::TellEnd(std::uint32_t device, double drift, const WriteResult& result,
                             Now now) const {
  const bool done = result.end == WriteEnd::ok;
  std::string text = "it was " + Shown(drift);
  if (result.end == WriteEnd::unknown) text += "; the device has not confirmed the correction";
  if (!done) text += "; " + result.reason;
  links_.tell(device, done, text, now);
}

void ClockCorrector::Keep(std::uint32_t device, const protocols::ClockCare& care, double before,
                          Now now) {
  not_before_.erase(device);
  if (!MayTry(device, care, now)) return;
  not_before_[device] = now.instant + kBetweenReads;
  Duration age = Duration::max();
  links_.store.Read(device, [&](const bus::DeviceRecord& record) {
    const auto& read = record.points[care.drift].read_at;
    if (read) age = now.instant - *read;
  });
  const auto drift = DriftOf(device, care, now.instant);
  if (!drift || age > kFresh || std::abs(*drift - before) > kAlike) return;
  if (std::abs(*drift) < Seconds(care.least)) return;
  tries_->Set(device, std::string(kTried) + std::to_string(UnixTime(now.wall).count()));
  if (std::abs(*drift) > Seconds(care.most)) {
    links_.tell(device, false,
                "it is " + Shown(*drift) + ", more than " + protocols::kCorrectClockMost + ": " +
                    FormatDuration(care.most) + "; set the clock by hand",
                now);
    return;
  }
  under_way_[device] = {
      .step = UnderWay::Step::keeps, .drift = *drift, .held = links_.store.Hold(device)};
}

void ClockCorrector::Correct(std::uint32_t device, const protocols::ClockCare& care, double drift,
                             Now now) {
  UnderWay& begun = under_way_[device];
  begun.step = UnderWay::Step::writes;
  begun.held = links_.store.Hold(device);
  begun.drift = drift;
  bus::WriteAsk ask;
  ask.device = device;
  ask.parts.push_back({care.correction, Value(true)});
  ask.deadline = now.instant + kAnswerPatience;
  ask.done = [answered = begun.answered](const WriteResult& result) {
    const MutexLock lock(answered->mutex);
    answered->result = result;
  };
  if (const auto refusal = gate_.Submit(kWriter, std::move(ask), now.instant)) {
    under_way_.erase(device);
    links_.tell(device, false, "it is " + Shown(drift) + "; " + refusal->text, now);
  }
}

namespace {

constexpr std::chrono::microseconds kWaitForReply = std::chrono::seconds(2);

}  // namespace

std::optional<bool> AskTimeService() {
  sd_bus* opened = nullptr;
  if (sd_bus_open_system(&opened) < 0) return std::nullopt;
  const std::unique_ptr<sd_bus, decltype(&sd_bus_flush_close_unref)> bus(opened,
                                                                         sd_bus_flush_close_unref);
  return AskTimeService(*bus);
}

std::optional<bool> AskTimeService(sd_bus& bus) {
  sd_bus_set_method_call_timeout(&bus, static_cast<std::uint64_t>(kWaitForReply.count()));
  int synchronised = 0;
  if (sd_bus_get_property_trivial(&bus, "org.freedesktop.timedate1", "/org/freedesktop/timedate1",
                                  "org.freedesktop.timedate1", "NTPSynchronized", nullptr, 'b',
                                  &synchronised) < 0) {
    return std::nullopt;
  }
  return synchronised != 0;
}

namespace {

constexpr Duration kInterval = 5s;
// The time service is asked less often, because each request starts timedated, which then runs for
// a while.
constexpr Duration kServiceInterval = 1min;

/// Returns nothing if this process is not allowed to ask the kernel.
std::optional<bool> AskKernel() {
  timex state{};
  const int found = ntp_adjtime(&state);
  if (found < 0 && errno == EPERM) return std::nullopt;
  return found >= 0 && found != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
}

}  // namespace

HostClock::HostClock(std::function<void(bool)> tell)
    : tell_(std::move(tell)), worker_("clock", [this](bool last) {
        return last ? kWhenWoken : ReadClocks().instant + Look();
      }) {
  worker_.Start();
}

Duration HostClock::Look() {
  const auto kernel = AskKernel();
  const bool right = kernel ? *kernel : AskTimeService().value_or(false);
  if (std::exchange(told_, right) != right) tell_(right);
  return kernel ? kInterval : kServiceInterval;
}

}  // namespace baudgate::daemon
