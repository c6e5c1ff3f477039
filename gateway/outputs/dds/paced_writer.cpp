// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/paced_writer.h"

#include <utility>

namespace baudgate::dds {
namespace {

// Loss-free even on the 208 KiB socket buffers that a kernel grants by default: 20 samples/ms.
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
      log_(log::Level::info,
           "samples are taken again; " + std::to_string(failing_) + " were refused and repeated");
    }
    failing_ = 0;
    return;
  }
  ++failed_;
  if (failing_++ == 0 && log_) {
    log_(log::Level::warning,
         "a sample of " + std::string(whose) + name + " was refused; it will be repeated");
  }
}

}  // namespace baudgate::dds
