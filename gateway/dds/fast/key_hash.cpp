// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/key_hash.h"

#include <fastrtps/utils/md5.h>

#include <algorithm>
#include <initializer_list>
#include <string_view>

namespace baudgate::dds {
namespace {

constexpr std::size_t kMostKeys = 4;
constexpr std::size_t kLongestKey = std::max(kMaxKey, kMaxAlarmName);

KeyHash HashTexts(std::initializer_list<std::string_view> texts) {
  std::array<std::uint8_t, kMostKeys*(4 + kLongestKey + 1 + 3)> key{};
  std::size_t used = 0;
  for (const std::string_view whole : texts) {
    const std::string_view text = whole.substr(0, kLongestKey);
    used = (used + 3) / 4 * 4;
    const auto length = static_cast<std::uint32_t>(text.size() + 1);
    for (const unsigned shift : {24U, 16U, 8U, 0U}) {
      key[used++] = static_cast<std::uint8_t>(length >> shift);
    }
    std::copy(text.begin(), text.end(), key.begin() + static_cast<std::ptrdiff_t>(used));
    used += text.size();
    key[used++] = 0;
  }
  ::MD5 md5;
  md5.init();
  md5.update(key.data(), static_cast<unsigned int>(used));
  md5.finalize();
  KeyHash hash;
  std::copy(std::begin(md5.digest), std::end(md5.digest), hash.begin());
  return hash;
}

}  // namespace

KeyHash HashKey(const PointSample& sample) {
  return HashTexts({sample.gateway, sample.device, sample.point});
}
KeyHash HashKey(const DeviceSample& sample) { return HashTexts({sample.gateway, sample.device}); }
KeyHash HashKey(const GatewaySample& sample) { return HashTexts({sample.gateway}); }
KeyHash HashKey(const EventSample& sample) { return HashTexts({sample.gateway, sample.device}); }
KeyHash HashKey(const AlarmSample& sample) {
  return HashTexts({sample.gateway, sample.line, sample.device, sample.name});
}
KeyHash HashKey(const RequestSample& sample) { return HashTexts({sample.gateway, sample.client}); }
KeyHash HashKey(const ReplySample& sample) { return HashTexts({sample.gateway, sample.client}); }

}  // namespace baudgate::dds
