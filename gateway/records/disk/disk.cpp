// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/disk.h"

#include <array>

namespace baudgate::records {

std::string_view Name(Disk disk) {
  constexpr std::array<std::string_view, 4> kNames = {"opening", "fine", "stalled", "failing"};
  return kNames[static_cast<std::size_t>(disk)];
}

DiskCalls::DiskCalls(std::string name, Duration patience)
    : patience_(patience), worker_(std::move(name), [this](bool) {
        while (const auto call = calls_.Take()) {
          (*call)();
          --pending_;
        }
        return kWhenWoken;
      }) {
  worker_.Start();
}

bool DiskCalls::Offer(std::function<void()> call) {
  return pending_ == 0 && Begin(std::move(call));
}

bool DiskCalls::Begin(Call call) {
  ++pending_;
  if (worker_.stopping() || !calls_.Put(std::move(call))) {
    --pending_;
    return false;
  }
  worker_.Wake();
  return true;
}

}  // namespace baudgate::records
