// DiagnoseLine and DiagnoseDevice turn counters and states into sentences for `baudgate status`:
// why a line or a device does not work well, and what to do. docs/status.md explains the sentences.
// The functions above DiagnoseLine judge one subject each. All functions are pure.
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

// Functions that return sentences return an empty list or text if they find nothing to report.

// ---------------- diagnose_failures.cpp: exchanges that failed, and requests that a device refuses

/// Fewer failures of a device that answers are not reported.
inline constexpr std::size_t kNotableFailures = 2;

/// Returns the likeliest cause of the failures as `before` + "cause. Remedy", then one sentence for
/// each additional observation about that cause.
std::vector<std::string> Said(const std::string& before, const Evidence& evidence);
/// True if the exchanges of the device fail because its requests come back (echo). The line has a
/// sentence about the echo then, so the device needs none.
bool FailsByEchoes(const Evidence& evidence);
/// Sentences about failed exchanges and refused requests; the more frequent kind comes first.
std::vector<std::string> Failures(const bus::DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_beside.cpp: bytes beside good replies

/// Fewer exchanges with stray bytes, of those that are stored, are not reported.
inline constexpr std::size_t kNotableNoise = 3;

/// True if nearly all replies of the device have the same bytes around them.
bool IsWrapped(const bus::DeviceRecord& record);
/// True if two devices seem to have the same address: second replies come, and some of them differ
/// from the first reply. A repeater only sends copies.
bool AreTwo(const bus::Findings& findings);
/// Sentences about stray bytes beside the good replies of one device. Stray bytes of the whole line
/// are reported in gateway/diagnosis/causes/diagnose_line.cpp. `alone`: no neighbour has stray
/// bytes.
std::vector<std::string> Beside(const bus::DeviceRecord& record, bool alone);

// ---------------- diagnose_points.cpp: points of a device that answers

/// Line and device: "bay-1.feeder-1".
std::string NameOf(const bus::DeviceRecord& record);

/// True if the device refuses points, all of which had a value before.
bool RefusesWhatItGave(const bus::DeviceRecord& record);
/// True if the device lacks an option: it refuses up to half of its points, some of which never had
/// a value.
bool LacksOptions(const bus::DeviceRecord& record);

/// True if no value is good because of the whole device: another device answers in its place, or
/// its password or access level is wrong.
bool IsForeign(const bus::DeviceRecord& record);

/// Sentences about values that are not good although the device answers. A value counts as too old
/// only if the port of `line` has been open for longer than its age limit, so that it was polled.
std::vector<std::string> DiagnosePoints(const bus::LineStatus& line,
                                        const bus::DeviceRecord& record, Now now);

/// A note about points that have no value although nothing is wrong: an option that is not fitted,
/// a motor at rest. The note is shown after all other sentences.
std::vector<std::string> NoteAbsent(const bus::LineStatus& line, const bus::DeviceRecord& record,
                                    Now now);

/// Sentences about polled points that have never had a value although the device answers.
std::vector<std::string> DiagnoseWaiting(const bus::DeviceRecord& record, Now now, Instant started);

// ---------------- diagnose_points.cpp: impossible numbers, such as those of a wrong byte order

/// Returns a sentence if the device refuses exactly the first or the last point of a row of at
/// least `least` addresses: then the addresses of the profile are off by one.
std::string OffByOne(const bus::DeviceRecord& record, std::size_t least = 3);
/// Returns at most one sentence.
std::vector<std::string> AbsurdNumbers(const bus::DeviceRecord& record, Now now);

// ---------------- diagnose_beside.cpp: a device that sends unasked

/// Sentences about messages that cannot be read, if these are frequent.
std::vector<std::string> Unreadable(const bus::DeviceRecord& record, const Evidence& evidence);
std::vector<std::string> Silence(const bus::DeviceRecord& record, Now now);
/// The shortest age limit of the device's values: at least one message must come within this time.
/// Nothing: the device may be silent for any time, for example an unused card reader.
std::optional<Duration> MustSpeakWithin(const bus::DeviceRecord& record);

/// The period at which the device sends, if it is longer than the age limit of its values. Nothing:
/// the values come in time or irregularly, or the device has stopped sending.
std::optional<Duration> ComesEvery(const bus::DeviceRecord& record, Instant now);
/// Reports a device that sends unasked but answers no command.
std::vector<std::string> AnswersNothing(const bus::DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_port.cpp: a port that is closed, lost, or ended by the server

std::string SayClosed(const config::Line& line, const bus::LineStatus& status,
                      std::span<const bus::DeviceRecord> devices, Now now);

/// Sentences about an open port that was lost often, or that the server ended often.
std::vector<std::string> AboutLosses(const config::Line& line, const bus::LineStatus& status,
                                     std::span<const bus::DeviceRecord> devices, Now now);

/// Reports that the server ends the connection after each answer, so that polls are missed or fail.
std::string SayEndsEach(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                        Now now);

/// Why the connections after `since` ended, and the remedy, in one sentence; if no cause is
/// recognised, what to check. `in_use`: these connections ended while they were in use, so an
/// inactivity limit is not the cause.
std::string WhyEnded(const bus::LineStatus& status, Instant since, bool in_use);

// ---------------- diagnose_line.cpp: the use of a line's time in the last minutes

/// The share of poll periods that was missed in the last five minutes, 0 to 1; below 2 % 0.
double MissedShare(const bus::DeviceRecord& device, Now now, Instant started);

/// Why the line has no time, and what to do: "feeder-1 takes 62 % of the line's time, 350 ms an
/// exchange. Raise its poll, …". Empty: the cause is unknown, or another sentence names it (for
/// example failing exchanges of a device). `device`: the text calls this device "it"; null: the
/// text names every device.
std::string WhyNoTime(const bus::LineStatus& line, std::span<const bus::DeviceRecord> devices,
                      const bus::DeviceRecord* device, Now now, Instant started);

/// Sentences about a line, the most important first; empty if the line works well. `devices`: all
/// devices of the line. `started`: when the gateway began to poll.
std::vector<std::string> DiagnoseLine(const config::Line& line, const bus::LineStatus& status,
                                      std::span<const bus::DeviceRecord> devices, Now now,
                                      Instant started);

/// Sentences about a device, the most important first. Empty if the device works well, or if its
/// line is not open: then the sentence of the line explains the state.
std::vector<std::string> DiagnoseDevice(const bus::LineStatus& line,
                                        const bus::DeviceRecord& device,
                                        std::span<const bus::DeviceRecord> devices, Now now,
                                        Instant started);

/// The time of day: "12:04:05 UTC".
std::string ClockText(WallTime time);

}  // namespace baudgate::diagnosis
