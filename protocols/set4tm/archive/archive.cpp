// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/archive.h"

#include "gateway/base/time.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {

namespace {

/// Every value of load profiles and billing readings is a count of energy.
const Match kCount = {kNoPoint, Field{{}, Decoder::energy, 0, 0}};

constexpr std::size_t PartOf(std::size_t job) { return job + 1; }

}  // namespace

MeterArchive::MeterArchive(bool events, const Settings& settings, Identification& identification)
    : events_(events),
      settings_(settings),
      identification_(identification),
      journals_(events, static_cast<std::size_t>(settings.journal_records)),
      loads_(settings),
      billing_(settings) {}

std::optional<Instant> MeterArchive::due() const {
  std::optional<Instant> soonest;
  for (const BackgroundJob* one : jobs_) soonest = Soonest({soonest, one->due()});
  return soonest;
}

bool MeterArchive::IsDue(Instant now) const { return HasCome(due(), now); }

void MeterArchive::OnKept(std::string_view said) {
  const auto changed = kept_.OnKept(said);
  if (changed[KeptTexts::kJournals]) journals_.OnKept(kept_.part(KeptTexts::kJournals));
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    if (changed[PartOf(i)]) jobs_[i]->OnKept(kept_.part(PartOf(i)));
  }
}

void MeterArchive::OnMeter(std::uint32_t serial) {
  journals_.OnMeter(serial);
  for (BackgroundJob* one : jobs_) one->OnMeter(serial);
}

void MeterArchive::OnReconnect() {
  journals_.OnReconnect();
  for (BackgroundJob* one : jobs_) one->OnReconnect();
}

void MeterArchive::ForgetRefusals(bool journals) {
  if (journals) journals_.ForgetRefusals();
  for (BackgroundJob* one : jobs_) one->ForgetRefusals();
}

Answer MeterArchive::TakeRecord(View data, Instant now) {
  const JournalReader reader{settings_.time_zone, identification_.KnowsStatusWord()};
  return kept_.With(KeptTexts::kJournals, journals_.Take(data, reader, now));
}

Answer MeterArchive::TakeNoRecord(Answer answer, Instant now) {
  return kept_.With(KeptTexts::kJournals, journals_.TakeRefusal(std::move(answer), now));
}

/// The type says how long replies may be.
std::optional<Bytes> MeterArchive::Question() {
  identification_.WantType();
  return identification_.Question({&kCount, 1});
}

Bytes MeterArchive::NextInBackground(Instant now) {
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    const auto due = jobs_[i]->due();
    const auto other = job().due();
    if (due && (!other || *due < *other)) job_ = i;
  }
  job().OnType(identification_.type());
  return job().Next(now);
}

Answer MeterArchive::TakeInBackground(View data, Instant now) {
  return kept_.With(PartOf(job_), job().Take(data, identification_.scale(), now));
}

std::string MeterArchive::Learned() const {
  return Listed({events_ && journals_.has_refused() ? "no journals: it refuses them" : "",
                 loads_.Shown(), billing_.Shown()});
}

}  // namespace baudgate::protocols::set4tm
