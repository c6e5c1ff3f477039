// What a meter is asked when nothing else is due: load profiles, billing readings.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/conversation_steps.h"

namespace baudgate::protocols::set4tm {
namespace {

/// All of it are counts of energy.
const Match kCount = {kNoPoint, Field{{}, Decoder::energy, 0, 0}};

constexpr std::size_t PartOf(std::size_t job) { return job + 1; }

}  // namespace

void MeterConversation::OnEventsKept(std::string_view said) {
  const auto changed = kept_.OnKept(said);
  if (changed[KeptTexts::kJournals]) journals_.OnKept(kept_.part(KeptTexts::kJournals));
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    if (changed[PartOf(i)]) jobs_[i]->OnKept(kept_.part(PartOf(i)));
  }
}

std::optional<Instant> MeterConversation::BackgroundDue() const {
  std::optional<Instant> soonest;
  for (const BackgroundJob* one : jobs_) {
    const auto due = one->due();
    if (due && (!soonest || *due < *soonest)) soonest = due;
  }
  if (settings_.latch == Duration::zero() || latch_.refused()) return soonest;
  if (latch_.WantsTime(line_latch_.number())) return Instant();
  const auto due = line_latch_.DueAt(settings_.latch);
  return due && (!soonest || *due < *soonest) ? due : soonest;
}

/// Its type says how long its replies may be.
Bytes MeterConversation::NextInBackground(Instant now) {
  identification_.WantType();
  if (const auto question = identification_.Question({&kCount, 1})) return *question;
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    const auto due = jobs_[i]->due();
    const auto other = job().due();
    if (due && (!other || *due < *other)) job_ = i;
  }
  job().OnType(identification_.type());
  return asked_in_background_ = job().Next(now);
}

Answer MeterConversation::AfterBackground(Reply reply, Instant now) {
  if (Is(reply.pdu, AskLatchTime())) return End(std::move(reply.answer));
  if (!Is(reply.pdu, asked_in_background_)) {
    if (identification_.trouble()) return End(OtherType());
    Answer answer = AskAgain();
    if (!ChooseIntegers()) return answer;
    answer.then = Then::restart;
    return End(std::move(answer));
  }
  return End(kept_.With(PartOf(job_), job().OnData(reply.data, identification_.scale(), now)));
}

}  // namespace baudgate::protocols::set4tm
