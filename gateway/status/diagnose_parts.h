// The parts of a diagnosis (gateway/status/diagnose.h), a subject and a source each: what is said
// of it, as sentences. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gateway/status/evidence.h"

namespace baudgate::control {

// ---------------- diagnose_failures.cpp: exchanges that failed, and requests that a device refuses

/// A single failure of a device that answers is not worth a sentence.
inline constexpr std::size_t kNotableFailures = 2;

/// "cause: remedy" behind `before`, and in sentences of their own what goes with it.
std::vector<std::string> Said(const std::string& before, const Evidence& evidence);
/// Requests come back, and what fails looks like that. The line's sentence says it.
bool FailsByEchoes(const Evidence& evidence);
/// What fails, and what it refuses: what there is more of comes first.
std::vector<std::string> Failures(const DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_beside.cpp: bytes beside good replies

/// Bytes beside good replies, of the exchanges that are kept.
inline constexpr std::size_t kNotableNoise = 3;

/// The same bytes stand around nearly all of its replies.
bool IsWrapped(const DeviceRecord& record);
/// Two devices have its address: many of their replies are alike, and a repeater never changes one.
bool AreTwo(const Findings& findings);
/// Where it is not the line's (gateway/status/diagnose_line.cpp). `alone`: beside the replies of
/// its neighbours nothing stands.
std::vector<std::string> Beside(const DeviceRecord& record, bool alone);

// ---------------- diagnose_points.cpp: points of a device that answers

/// "bay-1.feeder-1".
std::string NameOf(const DeviceRecord& record);

/// It refuses points that it gave before, all of them.
bool RefusesWhatItGave(const DeviceRecord& record);
/// It has never given some of its points, and refuses these; it gives others, most of them.
bool LacksOptions(const DeviceRecord& record);

/// It is not what it should be, so that no value of it is good.
bool IsForeign(const DeviceRecord& record);

/// Values that are not good although the device answers. Their age is not spoken of before the port
/// of `line` has been open as long as they may be old: their polls had no chance yet.
std::vector<std::string> DiagnosePoints(const LineStatus& line, const DeviceRecord& record,
                                        Now now);

/// Points that lack a value and are in order so; said behind everything else.
std::vector<std::string> NoteAbsent(const LineStatus& line, const DeviceRecord& record, Now now);

/// Points that are polled and have never had a value, although the device answers.
std::vector<std::string> DiagnoseWaiting(const DeviceRecord& record, Now now, Instant started);

// ---------------- absurd_numbers.cpp: numbers that nothing measures, such as bytes in another
// order make

/// The device refuses the first or the last of a row of addresses (`least` or more), and no other:
/// they are off by one. Empty: it is not so.
std::string OffByOne(const DeviceRecord& record, std::size_t least = 3);
/// One sentence, or none.
std::vector<std::string> AbsurdNumbers(const DeviceRecord& record, Now now);

// ---------------- diagnose_unasked.cpp: a device that speaks when it likes

/// Nothing that it says can be read, or much cannot.
std::vector<std::string> Unreadable(const DeviceRecord& record, const Evidence& evidence);
std::vector<std::string> Silence(const DeviceRecord& record, Now now);
/// Values that have to come again and again; nothing: it may be silent for ever, as a reader at
/// which nobody reads.
std::optional<Duration> MustSpeakWithin(const DeviceRecord& record);

/// The period at which it sends, where its values are too old before the next ones come. Empty:
/// they are not, or it has stopped.
std::optional<Duration> ComesEvery(const DeviceRecord& record, Instant now);
/// It speaks by itself, and answers nothing that it is asked.
std::vector<std::string> AnswersNothing(const DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_port.cpp: the port of a line or its connection: closed, lost, or ended
// by the server

/// Why a port that is not open is not.
std::string SayClosed(const config::Line& line, const LineStatus& status,
                      std::span<const DeviceRecord> devices, Now now);

/// An open port: it was lost, or the server ended its connection, so often that it is no chance.
std::vector<std::string> AboutLosses(const config::Line& line, const LineStatus& status,
                                     std::span<const DeviceRecord> devices, Now now);

/// A server that ends the connection behind each answer, where that costs polls. Empty: it is not
/// so.
std::string SayEndsEach(const LineStatus& status, std::span<const DeviceRecord> devices, Now now);

/// Cause and remedy of the ends since then; where nothing stands out, what to look at. `in_use`:
/// the connections had survived longer rests.
std::string WhyEnded(const LineStatus& status, Instant since, bool in_use);

// ---------------- line_time.cpp: what the time of a line went to in the last minutes, and whether
// that is why polls are missed

/// The part of its poll periods that was missed in the last five minutes; a small part counts as
/// none.
double MissedShare(const DeviceRecord& device, Now now, Instant started);

/// Why there is no time, and what to do: "feeder-1 takes 62 % of the line's time, 350 ms an
/// exchange: raise its poll, …". Empty: exchanges that fail take it, and their device says why; or
/// it is not known. `device`: "it" in place of its name; null: nobody.
std::string WhyNoTime(const LineStatus& line, std::span<const DeviceRecord> devices,
                      const DeviceRecord* device, Now now, Instant started);

}  // namespace baudgate::control
