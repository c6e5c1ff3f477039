// Fuzzes the discovery server: one relay receives all datagrams of an input.
// Input: datagrams, each with a length (2 bytes, big-endian), the last byte of the sender's address
// 127.0.0.x, the time that has passed (a byte, in 50 ms), and its bytes.
#include "gateway/outputs/dds/discovery/announcement_relay.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using namespace dds;

constexpr std::uint32_t kLoopback = 0x7F000000;

void CheckOne(AnnouncementRelay& relay, const Bytes& datagram, UdpAddress sender, Instant now) {
  const std::size_t before = relay.participants();
  const Relayed relayed = relay.On(datagram, sender, now);
  Require(relay.participants() <= 4, "there are never more participants than places");
  Require(relay.participants() <= before + 1, "a datagram brings one at most");
  Require(relayed.refused.empty() || relayed.introductions.empty(),
          "what is refused has no effect");
  Require(relayed.introductions.size() <= 6, "of four: three to the newcomer, three to the others");
  for (const Introduction& one : relayed.introductions) {
    Require(one.to.address >> 8 == kLoopback >> 8, "only senders are sent to");
    Require(one.datagram.size() <= 600, "an announcement does not grow");
    // A separate copy lets AddressSanitizer detect reads beyond the end.
    const Bytes passed(one.datagram.begin(), one.datagram.end());
    bool read = false;
    for (std::uint32_t last = 0; last < 256 && !read; ++last) {
      read = ReadAnnouncement(passed, {kLoopback | last, 7400}).ok();
    }
    Require(read, "what is passed on is an announcement");
  }
}

void FuzzAnnouncementRelay(View bytes) {
  Input input(bytes);
  dds::AnnouncementRelay relay(dds::RelayLimits{
      .participants = 4, .of_address = 3, .datagram = 600, .new_of_address = {8, 8}});
  Instant now = Instant(std::chrono::hours(1));
  while (!input.empty()) {
    const std::size_t high = input.U8();
    const std::size_t length = high << 8 | input.U8();
    const dds::UdpAddress sender{kLoopback | input.U8(), 7400};
    now += std::chrono::milliseconds(50 * input.U8());
    const View piece = input.Take(length);
    CheckOne(relay, Bytes(piece.begin(), piece.end()), sender, now);
  }
}

const Registered kAnnouncementRelay("announcement_relay", FuzzAnnouncementRelay);

}  // namespace
}  // namespace baudgate::fuzz
