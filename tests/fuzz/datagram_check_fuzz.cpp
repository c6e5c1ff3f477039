// Fuzzes `DatagramCheck`, through which datagrams pass before the DDS library receives them. One
// check receives all datagrams of an input.
// Input: a byte of options, then datagrams, each with a length (2 bytes, big-endian), a byte of the
// sender's address, a byte of time that has passed, and its bytes.
#include "gateway/outputs/dds/fast/datagram_check.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using namespace dds;

void CheckOne(DatagramCheck& check, Secured security, const Bytes& datagram, Sender sender,
              Instant now) {
  const Verdict verdict = check.Check(datagram, sender, now);
  Require(check.participants().size() <= 4, "there are never more participants than places");
  if (!verdict.passes()) {
    Require(!Words(verdict.reason).empty(), "a refusal has words");
    return;
  }
  Require(verdict.length >= 20 && verdict.length <= datagram.size(), "a header at least");
  Require(verdict.edit_count <= verdict.edits.size(), "edits have room");
  Bytes passed(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(verdict.length));
  for (std::size_t i = 0; i < verdict.edit_count; ++i) {
    const Edit& edit = verdict.edits[i];
    Require(edit.at + edit.bytes.size() <= passed.size(), "an edit lies inside");
    std::copy(edit.bytes.begin(), edit.bytes.end(),
              passed.begin() + static_cast<std::ptrdiff_t>(edit.at));
  }
  Require(verdict.hidden_count <= verdict.hidden.size(), "what is hidden has room");
  for (std::size_t i = 0; i < verdict.hidden_count; ++i) {
    Require(verdict.hidden[i] + 2U <= passed.size(), "what is hidden lies inside");
    passed[verdict.hidden[i]] = passed[verdict.hidden[i] + 1U] = 0;
  }
  // A new check has no state of earlier datagrams, so it must accept what the first check accepted.
  constexpr std::int64_t kAny = std::int64_t{1} << 62;
  constexpr WindowLimits kEndless{.burst = kAny, .each_second = 1, .first_of_samples = kAny};
  DatagramCheck fresh{CheckOptions{.security = security, .participants = {}, .window = kEndless}};
  const Verdict again = fresh.Check(passed, sender, now);
  Require(again.passes(), again.passes() ? "" : Words(again.reason));
  Require(again.length == passed.size(), "nothing more is left off");
  Require(again.edit_count == 0 && again.hidden_count == 0, "nothing more is changed");
}

void FuzzDatagramCheck(View bytes) {
  Input input(bytes);
  // Values 0 to 2 have the meaning of an older one-bit option, so that the corpus stays valid;
  // value 3 demands security.
  const int options = input.U8() & 3;
  const auto security = static_cast<dds::Secured>(options == 3 ? 2 : options & 1);
  dds::DatagramCheck check{dds::CheckOptions{
      .security = security, .participants = {.participants = 4, .of_address = 3}, .window = {}}};
  Instant now = Instant(std::chrono::hours(1));
  while (!input.empty()) {
    const std::size_t high = input.U8();
    const std::size_t length = high << 8 | input.U8();
    const dds::Sender sender{.address = input.U8(), .port = 7400};
    now += std::chrono::milliseconds(input.U8());
    const View piece = input.Take(length);
    CheckOne(check, security, Bytes(piece.begin(), piece.end()), sender, now);
  }
}

const Registered kDatagramCheck("datagram_check", FuzzDatagramCheck);

}  // namespace
}  // namespace baudgate::fuzz
