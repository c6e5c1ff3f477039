// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/devices.h"

#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "config/loader.h"
#include "gateway/bus/points/point_store.h"
#include "tests/fuzz/under_test.h"

namespace baudgate::fuzz {
namespace {

constexpr std::size_t kPointsOfSlice = 12;
constexpr std::uint8_t kVariants = 32;

struct Slice {
  const config::Profile* profile;
  std::size_t first;
};

config::Catalog ShippedCatalog() {
  return {
      .protocols = {{std::string(UnderTest().name), &UnderTest()}},
      .module_dirs = {},
      .profile_dirs = {FUZZ_SOURCE_DIR "/tests/fuzz/profiles", FUZZ_SOURCE_DIR "/config/profiles"}};
}

std::vector<config::Profile> LoadProfiles() {
  const config::Catalog catalog = ShippedCatalog();
  std::vector<config::Profile> profiles;
  for (const auto& file : catalog.Profiles(std::string(UnderTest().name))) {
    auto loaded = config::LoadProfile(file.name, UnderTest(), catalog);
    Require(loaded.ok(), "the profiles of the tree load");
    for (config::Point& point : loaded.profile.points) {
      config::Point writable = point;
      writable.access = config::Access::read_write;
      if (UnderTest().check_point(writable)) point = writable;
    }
    profiles.push_back(std::move(loaded.profile));
  }
  return profiles;
}

const std::vector<Slice>& Slices() {
  static std::map<const protocols::Protocol*, std::vector<config::Profile>> profiles_of;
  static std::map<const protocols::Protocol*, std::vector<Slice>> slices_of;
  std::vector<Slice>& slices = slices_of[&UnderTest()];
  if (!slices.empty()) return slices;
  const auto& profiles = profiles_of.emplace(&UnderTest(), LoadProfiles()).first->second;
  for (const config::Profile& profile : profiles) {
    for (std::size_t first = 0; first < profile.points.size(); first += kPointsOfSlice) {
      slices.push_back({&profile, first});
    }
  }
  Require(!slices.empty(), "there are profiles");
  return slices;
}

config::Device MakeDevice(const Slice& slice, std::uint8_t variant) {
  config::Profile part = *slice.profile;
  const auto begin = part.points.begin() + static_cast<std::ptrdiff_t>(slice.first);
  const auto count = std::min<std::ptrdiff_t>(part.points.end() - begin, kPointsOfSlice);
  part.points = std::vector<config::Point>(begin, begin + count);
  config::Device device = config::DeviceFromProfile(part, UnderTest(), "device", "1");
  if ((variant & 1U) != 0) device.options = OptionsOf(UnderTest(), variant >> 1U);
  return device;
}

bool IsNan(const Value& value) {
  const auto* number = std::get_if<double>(&value);
  return number != nullptr && std::isnan(*number);
}

void CheckReading(const protocols::Reading& reading, const config::Device& device) {
  Require(!IsGood(reading.quality) || !IsNan(reading.value), "NaN is never good");
  if (reading.point >= device.points.size()) {
    Require(reading.point == protocols::kNoPoint, "a reading names a point of the device, or none");
    Require(!reading.label.empty(), "a reading without a point has a label");
    return;
  }
  const config::Point& point = device.points[reading.point];
  const bus::Sample sample = bus::ToSample(point, reading);
  Require(sample.point == reading.point, "a sample keeps its point");
  Require(!IsGood(sample.quality) || HasValue(sample.value), "what is good has a value");
  if (const auto* number = std::get_if<double>(&sample.value)) {
    Require(std::isfinite(*number), "a stored number is finite");
  }
  const bool text = std::holds_alternative<std::string>(sample.value);
  Require(!HasValue(sample.value) || text == (point.type == config::Type::string),
          "a sample is of its point's type");
}

}  // namespace

const config::Device& DeviceOf(std::uint8_t slice, std::uint8_t variant) {
  static std::map<std::tuple<const protocols::Protocol*, std::size_t, std::uint8_t>, config::Device>
      made;
  const std::vector<Slice>& slices = Slices();
  const std::size_t index = slice % slices.size();
  variant %= kVariants;
  const std::tuple key(&UnderTest(), index, variant);
  const auto found = made.find(key);
  if (found != made.end()) return found->second;
  return made.emplace(key, MakeDevice(slices[index], variant)).first->second;
}

void CheckAnswer(const protocols::Answer& answer, const config::Device& device) {
  const bool life = ProvesLife(answer.outcome);
  // If an exchange fails, the task can end with an answer whose outcome is no_reply or partial.
  Require(answer.outcome != Outcome::none && answer.outcome != Outcome::line_down,
          "an answer has an outcome of an exchange");
  Require(answer.outcome == Outcome::ok || answer.then == protocols::Then::ask_again ||
              !answer.reason.empty(),
          "what is not ok has a reason");
  Require(answer.outcome == Outcome::ok || answer.reason.find('\n') == std::string::npos,
          "a reason is one line");
  Require(life || answer.readings.empty(), "a frame that does not fit gives no readings");
  Require(answer.wait >= Duration::zero(), "nobody waits back in time");
  for (const protocols::Reading& reading : answer.readings) CheckReading(reading, device);
}

}  // namespace baudgate::fuzz
