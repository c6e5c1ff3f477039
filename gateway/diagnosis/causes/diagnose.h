// DiagnoseLine and DiagnoseDevice make sentences for `baudgate status` from counters and states:
// why a line or a device does not work well, and what to do. docs/status.md explains the sentences.
// The functions above DiagnoseLine each handle one subject. No function does I/O or reads a clock.
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

// A function that returns sentences returns none (an empty list or text) if it finds nothing to
// report.

// ---------------- diagnose_failures.cpp: exchanges that failed, and requests that a device refuses

/// If a device that answers had fewer failures than this, they are not reported.
inline constexpr std::size_t kNotableFailures = 2;

/// Returns the most probable cause of the failures as `before` + "cause: remedy", then one sentence
/// for each further observation about this cause.
std::vector<std::string> Said(const std::string& before, const Evidence& evidence);
/// True if the exchanges of the device fail because its requests come back as echoes. A sentence of
/// the line reports the echo, so the device needs no sentence.
bool FailsByEchoes(const Evidence& evidence);
/// Returns sentences about failed exchanges and refused requests. The more frequent of both is
/// first.
std::vector<std::string> Failures(const bus::DeviceRecord& record, const Evidence& evidence);
/// True if the server ends the connection at certain requests to the device, while it answers other
/// requests. A sentence of Failures() names these requests.
bool EndsAtRequests(const bus::DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_beside.cpp: bytes beside good replies

/// Bytes beside good replies are reported from this number of exchanges on.
inline constexpr std::size_t kNotableNoise = 3;

/// True if nearly all replies of the device have the same bytes around them.
bool IsWrapped(const bus::DeviceRecord& record);
/// True if two devices seem to have one address: second replies come, and some differ from the
/// first. (If all are equal, a repeater sends them.)
bool AreTwo(const bus::Findings& findings);
/// Returns sentences about stray bytes beside good replies of one device. (Stray bytes of the whole
/// line: gateway/diagnosis/causes/diagnose_line.cpp.) `alone`: no other device has stray bytes.
std::vector<std::string> Beside(const bus::DeviceRecord& record, bool alone);

// ---------------- diagnose_points.cpp: points of a device that answers

/// Returns line and device, such as "bay-1.feeder-1".
std::string NameOf(const bus::DeviceRecord& record);

/// True if the device refuses points now, and each of them had a value before.
bool RefusesWhatItGave(const bus::DeviceRecord& record);
/// True if options of the device seem not to be fitted: it refuses some of its points, at most
/// half, and these have never had a value.
bool LacksOptions(const bus::DeviceRecord& record);

/// True if no value is good because of the device as a whole: another device answers in its place,
/// or its password or access level is wrong.
bool IsForeign(const bus::DeviceRecord& record);

/// Returns sentences about values that are not good although the device answers. `line` contains
/// since when the port is open: only if this is longer than the age limit of a value, the value is
/// reported as too old.
std::vector<std::string> DiagnosePoints(const bus::LineStatus& line,
                                        const bus::DeviceRecord& record, Now now);

/// Returns a note about points without a value although nothing is wrong, such as an option that is
/// not fitted or a motor at rest. It is shown after all other sentences.
std::vector<std::string> NoteAbsent(const bus::LineStatus& line, const bus::DeviceRecord& record,
                                    Now now);

/// Returns a sentence about polled points that never had a value although the device answers.
std::vector<std::string> DiagnoseWaiting(const bus::DeviceRecord& record, Now now, Instant started);

// ---------------- diagnose_points.cpp: impossible numbers, such as those of a wrong byte order

/// Returns a sentence if the device refuses only the first or only the last of at least `least`
/// addresses in a row: then the addresses in the profile are off by one.
std::string OffByOne(const bus::DeviceRecord& record, std::size_t least = 3);
/// Returns at most one sentence about good values that cannot be true, such as 1e30.
std::vector<std::string> AbsurdNumbers(const bus::DeviceRecord& record, Now now);

// ---------------- diagnose_beside.cpp: a device that sends unasked

/// Returns sentences about messages that cannot be read, if there are several.
std::vector<std::string> Unreadable(const bus::DeviceRecord& record, const Evidence& evidence);
std::vector<std::string> Silence(const bus::DeviceRecord& record, Now now);
/// Returns the shortest age limit of the device's values, at most a day: a message must come within
/// this time. Nothing: the device can be silent for any time, such as an unused card reader.
std::optional<Duration> MustSpeakWithin(const bus::DeviceRecord& record);

/// Returns the period at which the device sends, if it is longer than the age limit of its values.
/// Nothing: its values come within the age limit or irregularly, or the device has stopped sending.
std::optional<Duration> ComesEvery(const bus::DeviceRecord& record, Instant now);
/// Returns a sentence if a device that sends unasked answers no command.
std::vector<std::string> AnswersNothing(const bus::DeviceRecord& record, const Evidence& evidence);

// ---------------- diagnose_port.cpp: a port that is closed, lost, or ended by the server

std::string SayClosed(const config::Line& line, const bus::LineStatus& status,
                      std::span<const bus::DeviceRecord> devices, Now now);

/// Returns sentences about an open port that was lost often, or whose server often ended the
/// connection.
std::vector<std::string> AboutLosses(const config::Line& line, const bus::LineStatus& status,
                                     std::span<const bus::DeviceRecord> devices, Now now);

/// Returns a sentence if the server ends the connection after each answer, so that polls are missed
/// or fail.
std::string SayEndsEach(const bus::LineStatus& status, std::span<const bus::DeviceRecord> devices,
                        Now now);

/// Returns cause and remedy of connections that ended after `since`; if no cause is found, what to
/// check. `in_use`: the connections ended while they were used, so an inactivity limit of the
/// server is not the cause.
std::string WhyEnded(const bus::LineStatus& status, Instant since, bool in_use);

// ---------------- diagnose_line.cpp: the use of a line's time in the last minutes

/// Returns the share of poll periods that were missed in the last five minutes, 0 to 1. Returns 0
/// below 2 %, or if fewer than three were missed.
double MissedShare(const bus::DeviceRecord& device, Now now, Instant started);

/// Returns why the line has no time, and what to do, such as "feeder-1 takes 62 % of the line's
/// time, 350 ms per exchange. Poll it less often (poll), …". Empty: the cause is unknown, or
/// another sentence names it (such as failing exchanges of a device). `device`: the text is about
/// this device and calls it "it"; null: the text names every device.
std::string WhyNoTime(const bus::LineStatus& line, std::span<const bus::DeviceRecord> devices,
                      const bus::DeviceRecord* device, Now now, Instant started);

/// Returns sentences about a line, the most important first; empty: the line works well. `devices`:
/// all devices of the line. `started`: when the gateway began to poll.
std::vector<std::string> DiagnoseLine(const config::Line& line, const bus::LineStatus& status,
                                      std::span<const bus::DeviceRecord> devices, Now now,
                                      Instant started);

/// Returns sentences about a device, the most important first. Empty: the device works well, or a
/// sentence of the line explains its state (such as a closed port).
std::vector<std::string> DiagnoseDevice(const bus::LineStatus& line,
                                        const bus::DeviceRecord& device,
                                        std::span<const bus::DeviceRecord> devices, Now now,
                                        Instant started);

std::string ClockText(WallTime time);

}  // namespace baudgate::diagnosis
