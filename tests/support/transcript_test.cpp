// Tests of the player of golden transcripts.
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/transcript.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <fstream>

#include "gateway/base/text.h"
#include "tests/support/toy_protocol.h"

namespace baudgate {
namespace {

/// Writes a transcript of a device with two points and these exchanges. Returns its path.
std::string FileOf(const std::string& exchanges) {
  const std::string path = ::testing::TempDir() + "toy.transcript";
  std::ofstream(path) << "# toy\ndevice: address=A wait=10ms\npoint: first 1 float64\n"
                         "point: second S2 int16 slow rw\n"
                      << exchanges;
  return path;
}

std::string Ask(std::string_view text) { return "> " + ToHex(ToBytes(text)) + "\n"; }
std::string Reply(std::string_view body) { return "< " + ToHex(ToyReply(body)) + "\n"; }

const std::string kFirst = Ask("?A1\r") + Reply("A1=0.5") + "= first 0.5 good\n";

TEST(Transcript, FollowsQueriesSessionsAndRounds) {
  PlayTranscript(ToyProtocol(),
                 FileOf(kFirst + Ask("OA9\r") + Reply("A9") + Ask("?A2\r") + Reply("A2=70000") +
                        "= second bad: configuration, out of the type's range\n" + kFirst));
}

TEST(Transcript, OutcomesOfDamageAndSilenceMatch) {
  PlayTranscript(ToyProtocol(), FileOf(Ask("?A1\r") + "! no_reply\n" + Ask("OA9\r") + "< 55\n" +
                                       "! corrupt\n" + Ask("?A1\r") + "< 21 41\n+50ms\n< 31\n" +
                                       "! corrupt\n" + Ask("OA9\r") + "< 21\n! partial\n"));
}

const std::string kThird = "point: third 3 int16 w scale=0.5\n";

TEST(Transcript, WritesWithTheirSessionPass) {
  PlayTranscript(ToyProtocol(),
                 FileOf(kThird + "write: second 7\n" + Ask("OA9\r") + Reply("A9") + Ask("WA2=7\r") +
                        Reply("A2") + Ask("CA0\r") + Reply("A0") + "write: third 2.5\n" +
                        Ask("WA3=5\r") + Reply("A3~refused") + "! refused\n" + kFirst));
}

TEST(Transcript, AWriteThatSendsNothingPasses) {
  const std::string file = FileOf("point: fourth E4 int16 rw\nwrite: fourth 1\n! unsupported\n");
  PlayTranscript(ToyProtocol(), file);
}

TEST(Transcript, AWriteThatSendsAnUnexpectedRequestFails) {
  EXPECT_NONFATAL_FAILURE(
      PlayTranscript(ToyProtocol(), FileOf(kThird + "write: third 1\n! unsupported\n")),
      "nothing may be sent, but this is: 57 41 33 3D 32 0D");
}

TEST(Transcript, AWriteWithAnotherOutcomeFails) {
  EXPECT_NONFATAL_FAILURE(PlayTranscript(ToyProtocol(), FileOf(kThird + "write: third 1\n" +
                                                               Ask("WA3=2\r") + Reply("A3~busy"))),
                          "busy");
}

TEST(Transcript, AnUnfinishedWriteFails) {
  EXPECT_NONFATAL_FAILURE(
      PlayTranscript(ToyProtocol(), FileOf("write: second 7\n" + Ask("OA9\r") + Reply("A9"))),
      "not at its end");
}

TEST(Transcript, AWrongValueFails) {
  EXPECT_NONFATAL_FAILURE(
      PlayTranscript(ToyProtocol(), FileOf(Ask("?A1\r") + Reply("A1=0.5") + "= first 0.25 good\n")),
      "0.25");
}

TEST(Transcript, AWrongRequestFails) {
  EXPECT_NONFATAL_FAILURE(
      PlayTranscript(ToyProtocol(), FileOf(Ask("?A2\r") + Reply("A1=0.5") + "= first 0.5 good\n")),
      "3F 41 32 0D");
}

TEST(Transcript, AnOverlookedReadingFails) {
  EXPECT_NONFATAL_FAILURE(PlayTranscript(ToyProtocol(), FileOf(Ask("?A1\r") + Reply("A1=0.5"))),
                          "first 0.5 good");
}

TEST(Transcript, AnEmptyFileFails) {
  EXPECT_NONFATAL_FAILURE(PlayTranscript(ToyProtocol(), FileOf("")), "no exchange");
}

}  // namespace
}  // namespace baudgate
