// The player of golden transcripts itself: it must pass what is right and name what is not.
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/transcript.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <fstream>

#include "gateway/base/text.h"
#include "tests/support/toy_protocol.h"

namespace baudgate {
namespace {

/// A file with a device of two points, and these exchanges.
std::string FileOf(const std::string& exchanges) {
  const std::string path = ::testing::TempDir() + "toy.transcript";
  std::ofstream(path) << "# toy\ndevice: address=A wait=10ms\npoint: first 1 float64\n"
                         "point: second S2 int16 slow\n"
                      << exchanges;
  return path;
}

std::string Ask(std::string_view text) { return "> " + ToHex(ToBytes(text)) + "\n"; }
std::string Reply(std::string_view body) { return "< " + ToHex(ToyReply(body)) + "\n"; }

const std::string kFirst = Ask("?A1\r") + Reply("A1=0.5") + "= first 0.5 good\n";

TEST(Transcript, FollowsQueriesSessionsAndRounds) {
  PlayTranscript(ToyProtocol(),
                 FileOf(kFirst + Ask("OA0\r") + Reply("A0") + Ask("?A2\r") + Reply("A2=70000") +
                        "= second bad: configuration\n" + kFirst));
}

TEST(Transcript, OutcomesOfDamageAndSilence) {
  PlayTranscript(ToyProtocol(), FileOf(Ask("?A1\r") + "! no_reply\n" + Ask("OA0\r") + "< 55\n" +
                                       "! corrupt\n" + Ask("?A1\r") + "< 21 41\n+50ms\n< 31\n" +
                                       "! corrupt\n" + Ask("OA0\r") + "< 21\n! partial\n"));
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
