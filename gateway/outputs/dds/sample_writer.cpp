// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/sample_writer.h"

#include <utility>

namespace baudgate::dds {

bool Pacer::Take(Instant now) {
  const Instant reserved = std::max(reserved_until_, now);
  if (reserved - now > allowance_ - interval_) return false;
  reserved_until_ = reserved + interval_;
  return true;
}

void RequestIntake::Offer(WriteArrival arrival, Instant now) {
  if (Keep(arrival, now) && wake_) wake_();
}

bool RequestIntake::Keep(WriteArrival& arrival, Instant now) {
  const MutexLock lock(mutex_);
  if (waiting_.size() >= kMost || !pace_.Take(now)) {
    ++dropped_;
    return false;
  }
  waiting_.push_back(std::move(arrival));
  return true;
}

std::optional<WriteArrival> RequestIntake::Take() {
  const MutexLock lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  WriteArrival arrival = std::move(waiting_.front());
  waiting_.pop_front();
  return arrival;
}

std::uint64_t RequestIntake::dropped() const {
  const MutexLock lock(mutex_);
  return dropped_;
}

namespace {

// The rate is 20 samples per ms. At this rate nothing is lost, even with socket buffers of 208 KiB,
// the kernel's default.
constexpr Duration kPaceInterval = 50us;
constexpr std::uint32_t kPaceBurst = 100;
constexpr Duration kShortestHold = 1ms;

}  // namespace

PacedWriter::PacedWriter(SampleWriter& writer, Log log)
    : writer_(writer), log_(std::move(log)), pacer_(kPaceInterval, kPaceBurst) {}

void PacedWriter::Note(Sent sent, std::string_view whose, const std::string& name, Instant now) {
  if (sent == Sent::later) {
    hold_ = std::clamp(2 * hold_, kShortestHold, kLongestHold);
    held_until_ = now + hold_;
    return;
  }
  hold_ = {};
  if (sent == Sent::yes) {
    ++written_;
    if (failing_ > 0 && log_) {
      log_(log::Level::info, "DDS accepts samples again; " + std::to_string(failing_) +
                                 " samples were refused and sent again");
    }
    failing_ = 0;
    return;
  }
  ++failed_;
  if (failing_++ == 0 && log_) {
    log_(log::Level::warning, "DDS has refused a sample of " + std::string(whose) + name +
                                  "; the gateway sends it again");
  }
}

}  // namespace baudgate::dds
