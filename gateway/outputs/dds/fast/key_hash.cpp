// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/key_hash.h"

#include <fastrtps/utils/md5.h>

#include <algorithm>
#include <string_view>

namespace baudgate::dds {
namespace {

/// The longest key: each text as long as its bound, with its length and what fills it up.
template <typename Sample>
constexpr std::size_t LongestKey() {
  std::size_t bytes = 0;
  ForEachField<Sample>([&bytes](const auto& field) {
    if (field.key) bytes += 4 + field.bound + 1 + 3;
  });
  return bytes;
}

}  // namespace

template <typename Sample>
KeyHash HashKey(const Sample& sample) {
  std::array<std::uint8_t, LongestKey<Sample>()> key{};
  std::size_t used = 0;
  ForEachField<Sample>([&]<typename Value>(const Field<Sample, Value>& field) {
    if constexpr (std::is_same_v<Value, std::string>) {
      if (!field.key) return;
      const std::string_view text = std::string_view(sample.*field.member).substr(0, field.bound);
      used = (used + 3) / 4 * 4;
      const auto length = static_cast<std::uint32_t>(text.size() + 1);
      for (const unsigned shift : {24U, 16U, 8U, 0U}) {
        key[used++] = static_cast<std::uint8_t>(length >> shift);
      }
      std::copy(text.begin(), text.end(), key.begin() + static_cast<std::ptrdiff_t>(used));
      used += text.size();
      key[used++] = 0;
    }
  });
  ::MD5 md5;
  md5.init();
  md5.update(key.data(), static_cast<unsigned int>(used));
  md5.finalize();
  KeyHash hash;
  std::copy(std::begin(md5.digest), std::end(md5.digest), hash.begin());
  return hash;
}

template KeyHash HashKey(const PointSample& sample);
template KeyHash HashKey(const DeviceSample& sample);
template KeyHash HashKey(const GatewaySample& sample);
template KeyHash HashKey(const EventSample& sample);
template KeyHash HashKey(const AlarmSample& sample);
template KeyHash HashKey(const RequestSample& sample);
template KeyHash HashKey(const ReplySample& sample);

}  // namespace baudgate::dds
