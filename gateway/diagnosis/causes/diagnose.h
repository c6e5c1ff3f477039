// Why a line or a device is not well and what to do about it, in one sentence each: from counters
// and states to words. Pure; shown by `baudgate status`, explained in docs/status.md. The functions
// above DiagnoseLine judge one subject each.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/diagnosis/causes/evidence.h"

namespace baudgate::diagnosis {

// The parts of a diagnosis: each source below judges one
// subject, and returns sentences for the user. Pure. Where a function returns an empty text, it has
// found nothing to say.

// ---------------- diagnose_failures.cpp: exchanges that failed, and requests that a device refuses

/// A single failure of a device that answers is not worth a sentence.
inline constexpr std::size_t kNotableFailures = 2;

/// The likeliest cause of the failures: first a sentence `before` + "cause: remedy", then a
/// sentence each for what goes with that cause.
std::vector<std::string> Said(const std::string& before, const Evidence& evidence);
/// True if nearly all failures of the device are requests that come back. The device then needs no
/// sentence, because the sentence of its line names the cause.
bool FailsByEchoes(const Evidence& evidence);
/// Sentences about the exchanges that failed and about the requests that the device refused: first
/// about those of which there are more.
std::vector<std::string> Failures(const bus::DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_beside.cpp: bytes beside good replies

/// Bytes beside good replies, of the exchanges that are kept.
inline constexpr std::size_t kNotableNoise = 3;

/// True if the same bytes stand around nearly all replies of the device.
bool IsWrapped(const bus::DeviceRecord& record);
/// True if two devices seem to have the same address: second replies come, and some of them differ
/// from the first. A repeater only sends copies.
bool AreTwo(const bus::Findings& findings);
/// Sentences about bytes beside the good replies of one device; bytes beside the replies of the
/// whole line belong to gateway/diagnosis/causes/diagnose_line.cpp. `alone`: no neighbour has such
/// bytes.
std::vector<std::string> Beside(const bus::DeviceRecord& record, bool alone);

// ---------------- diagnose_points.cpp: points of a device that answers

/// "bay-1.feeder-1".
std::string NameOf(const bus::DeviceRecord& record);

/// True if the device refuses points, and has given every one of them before.
bool RefusesWhatItGave(const bus::DeviceRecord& record);
/// It has never given some of its points, and refuses these; it gives others, most of them.
bool LacksOptions(const bus::DeviceRecord& record);

/// True if a trouble of the whole device explains why no value is good: another device answers in
/// its place, or its password or access level is wrong.
bool IsForeign(const bus::DeviceRecord& record);

/// Sentences about values that are not good although the device answers. A value counts as too old
/// only if the port of `line` has been open for longer than its age limit; before that its polls
/// have not had their chance.
std::vector<std::string> DiagnosePoints(const bus::LineStatus& line,
                                        const bus::DeviceRecord& record, Now now);

/// A note about points that have no value although nothing is wrong: an option that is not fitted,
/// a motor at rest. The note comes after all other sentences.
std::vector<std::string> NoteAbsent(const bus::LineStatus& line, const bus::DeviceRecord& record,
                                    Now now);

/// Points that are polled and have never had a value, although the device answers.
std::vector<std::string> DiagnoseWaiting(const bus::DeviceRecord& record, Now now, Instant started);

// ---------------- diagnose_points.cpp: numbers that nothing measures, such as bytes in another
// order make

/// The device refuses the first or the last of a row of addresses (`least` or more), and no other:
/// they are off by one. Empty: it is not so.
std::string OffByOne(const bus::DeviceRecord& record, std::size_t least = 3);
/// One sentence, or none.
std::vector<std::string> AbsurdNumbers(const bus::DeviceRecord& record, Now now);

// ---------------- diagnose_beside.cpp: a device that speaks when it likes

/// Sentences about messages that cannot be read: all of them, or too many.
std::vector<std::string> Unreadable(const bus::DeviceRecord& record, const Evidence& evidence);
std::vector<std::string> Silence(const bus::DeviceRecord& record, Now now);
/// The longest time between two messages that the age limits of its values allow. Nothing: the
/// device may be silent for ever, as a card reader that nobody uses.
std::optional<Duration> MustSpeakWithin(const bus::DeviceRecord& record);

/// The period at which the device sends, if that is longer than its values may be old. Empty: the
/// values come in time or irregularly, or the device has stopped.
std::optional<Duration> ComesEvery(const bus::DeviceRecord& record, Instant now);
/// Says that the device speaks by itself, and answers no command.
std::vector<std::string> AnswersNothing(const bus::DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_port.cpp: the port of a line or its connection: closed, lost, or ended
// by the server

/// Why the port is not open.
std::string SayClosed(const config::Line& line, const bus::LineStatus& status,
                      std::span<const bus::DeviceRecord> devices, Now now);

/// An open port: it was lost, or the server ended its connection, so often that it is no chance.
std::vector<std::string> AboutLosses(const config::Line& line, const bus::LineStatus& status,
                                     std::span<const bus::DeviceRecord> devices, Now now);

/// Says that the server ends the connection after each answer, if polls are missed or fail
/// meanwhile.
std::string SayEndsEach(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                        Now now);

/// Cause and remedy of the connections that have ended after `since`. If no cause stands out: what
/// to look at. `in_use`: the connections had survived longer rests before.
std::string WhyEnded(const bus::LineStatus& status, Instant since, bool in_use);

// ---------------- diagnose_line.cpp: what the time of a line went to in the last minutes, and
// whether that is why polls are missed

/// The part of its poll periods that was missed in the last five minutes; a small part counts as
/// none.
double MissedShare(const bus::DeviceRecord& device, Now now, Instant started);

/// Why the line has no time, and what to do: "feeder-1 takes 62 % of the line's time, 350 ms an
/// exchange: raise its poll, …". Empty: the cause is unknown, or another sentence names it (failing
/// exchanges of a device). `device`: the device that the text calls "it" instead of by its name, or
/// null.
std::string WhyNoTime(const bus::LineStatus& line, std::span<const bus::DeviceRecord> devices,
                      const bus::DeviceRecord* device, Now now, Instant started);

/// Empty when the line is well; the most important sentence first. `devices`: all of the line.
/// `started`: when the gateway began to poll.
std::vector<std::string> DiagnoseLine(const config::Line& line, const bus::LineStatus& status,
                                      std::span<const bus::DeviceRecord> devices, Now now,
                                      Instant started);

/// Empty when the device is well, or when its line is not open: then the line's sentence explains
/// it.
std::vector<std::string> DiagnoseDevice(const bus::LineStatus& line,
                                        const bus::DeviceRecord& device,
                                        std::span<const bus::DeviceRecord> devices, Now now,
                                        Instant started);

/// "12:04:05 UTC".
std::string ClockText(WallTime time);

}  // namespace baudgate::diagnosis
