// Tests of `ProcessLink`, the daemon's end of the link. The test simulates the DDS process.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/process_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <condition_variable>
#include <filesystem>
#include <mutex>

#include "gateway/base/text.h"
#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Lines {
 public:
  ProcessLink::Log Log() {
    return [this](log::Level, const std::string& line) {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line);
      changed_.notify_all();
    };
  }
  std::string WaitFor(const std::string& text) {
    std::unique_lock lock(mutex_);
    for (;;) {
      while (!lines_.empty()) {
        const std::string line = lines_.front();
        lines_.erase(lines_.begin());
        if (line.find(text) != std::string::npos) return line;
      }
      changed_.wait(lock);
    }
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> lines_;
};

class Directory {
 public:
  Directory() {
    std::string form = (fs::temp_directory_path() / "baudgate-link-XXXXXX").string();
    path_ = ::mkdtemp(form.data());
  }
  ~Directory() { fs::remove_all(path_); }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

class Played {
 public:
  explicit Played(const std::string& path) : socket_(std::move(*ConnectTo(path))) {}

  Bytes Receive() {
    pollfd waited{socket_.get(), POLLIN, 0};
    ::poll(&waited, 1, -1);
    const ReceivedPacket received = ReceivePacket(socket_.get(), buffer_);
    return {received.packet.begin(), received.packet.end()};
  }
  void Send(const Bytes& packet) { EXPECT_EQ(SendPacket(socket_.get(), packet), PacketSent::yes); }
  bool IsClosed() { return Receive().empty(); }

 private:
  Descriptor socket_;
  PacketBuffer buffer_{};
};

TEST(ProcessLink, AMissingProgramIsShownInTheState) {
  Lines lines;
  ProcessLinkOptions options;
  options.program = "/nowhere/baudgate-dds";
  auto link = std::move(*ProcessLink::Create(options, lines.Log()));
  EXPECT_THAT(lines.WaitFor("cannot be started"), HasSubstr("/nowhere/baudgate-dds: No such"));
  link->Stop();
  EXPECT_EQ(link->state().phase, LinkState::Phase::waiting);
  EXPECT_EQ(link->writer()->session(), 0U);
}

TEST(ProcessLink, AnEndedProgramIsRestarted) {
  Lines lines;
  const Directory directory;
  const std::string program = directory / "program";
  {
    FILE* file = ::fopen(program.c_str(), "w");
    ::fprintf(file, "#!/bin/sh\necho \"started with $1 $2\" >&2\nkill -SEGV $$\n");
    ::fclose(file);
    ::chmod(program.c_str(), 0700);
  }
  ProcessLinkOptions options;
  options.program = program;
  auto link = std::move(*ProcessLink::Create(options, lines.Log()));
  EXPECT_EQ(lines.WaitFor("process: "), "process: started with --link 3");
  EXPECT_EQ(lines.WaitFor("the process "),
            "the process was ended by signal 11; the gateway starts it again");
  EXPECT_EQ(lines.WaitFor("process: "), "process: started with --link 3");
}

class ProcessLinkAtASocket : public ::testing::Test {
 protected:
  void SetUp() override {
    ProcessLinkOptions options;
    options.open.gateway = "substation-7";
    options.open.room.points = 5;
    options.socket = path_;
    auto link = ProcessLink::Create(options, lines_.Log());
    ASSERT_TRUE(link.ok()) << link.error();
    link_ = std::move(*link);
  }

  Directory directory_;
  const std::string path_ = directory_ / "dds.sock";
  Lines lines_;
  std::unique_ptr<ProcessLink> link_;
};

TEST_F(ProcessLinkAtASocket, OnlyOwnerAndGroupMayConnect) {
  struct stat found {};
  ASSERT_EQ(::stat(path_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0660U);
  link_.reset();
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(ProcessLinkAtASocket, TheProcessIsAskedToOpenBeforeItGetsSamples) {
  Played process(path_);
  const Bytes first = process.Receive();
  const auto open = DecodeOpen(ParseLink(first)->body);
  ASSERT_TRUE(open.ok());
  EXPECT_EQ(open->gateway, "substation-7");
  EXPECT_EQ(link_->writer()->session(), 0U);
  EXPECT_EQ(link_->writer()->Write(PointSample()), Sent::later);
  process.Send(EncodeBare(LinkKind::opened));
  lines_.WaitFor("accepts samples");
  EXPECT_EQ(link_->writer()->Write(PointSample()), Sent::yes);
  EXPECT_EQ(ParseLink(process.Receive())->kind, LinkKind::point);
}

TEST_F(ProcessLinkAtASocket, AMalformedMessageEndsTheLinkAndANewProcessMayConnect) {
  const struct {
    Bytes packet;
    const char* reason;
  } kWrong[] = {
      {Bytes(3, 0x41), "sent a message of 3 bytes"},
      {Bytes(kMaxLinkMessage + 1, 0x41), "sent a message that is too long"},
      {EncodeBare(LinkKind::end), "sent a message of an unexpected kind"},
      {{0x42, kLinkVersion, 1, 0, 0}, "sent damaged counts"},
      {*ParseHex("40 01 00 00"), "sent a message of version 1"},
      {EncodeRequest({}), "sent a write request, although writing is not permitted"},
      {EncodeFailed("dds: interface 192.0.2.1 is not ours"), "did not start: dds: interface"},
  };
  for (const auto& wrong : kWrong) {
    Played process(path_);
    process.Receive();
    process.Send(wrong.packet);
    lines_.WaitFor(wrong.reason);
    EXPECT_TRUE(process.IsClosed());
  }
  Played process(path_);
  process.Receive();
  process.Send(EncodeBare(LinkKind::opened));
  lines_.WaitFor("accepts samples");
}

TEST(ProcessLink, RequestsAreForwardedWithAPlausibleTime) {
  Lines lines;
  const Directory directory;
  ProcessLinkOptions options;
  options.socket = directory / "dds.sock";
  options.open.requests = true;
  auto link = std::move(*ProcessLink::Create(options, lines.Log()));
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<WriteArrival> arrived;
  link->writer()->OnRequest([&](WriteArrival arrival) {
    const std::lock_guard lock(mutex);
    arrived.push_back(std::move(arrival));
    changed.notify_all();
  });
  Played process(options.socket);
  EXPECT_TRUE(DecodeOpen(ParseLink(process.Receive())->body)->requests);
  process.Send(EncodeBare(LinkKind::opened));
  WriteArrival arrival;
  for (const Instant received : {Instant::min(), Instant::max(), Instant()}) {
    arrival.received = received;
    ++arrival.request.seq;
    process.Send(EncodeRequest(arrival));
  }
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return arrived.size() == 3; });
  }
  const Instant now = ReadClocks().instant;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(arrived[i].request.seq, i + 1);
    EXPECT_LE(arrived[i].received, now) << "never in the future";
    EXPECT_GE(arrived[i].received, Instant() - 1h) << "nothing that overflows";
  }
  const ReplySample reply{"g", "c", 3, "ok", "", 1};
  lines.WaitFor("accepts samples");
  EXPECT_EQ(link->writer()->Write(reply), Sent::yes);
  EXPECT_EQ(ParseLink(process.Receive())->kind, LinkKind::reply);
  link->writer()->OnRequest({});
  process.Send({0x43, kLinkVersion, 1, 0, 0});
  lines.WaitFor("sent a damaged write request");
}

TEST_F(ProcessLinkAtASocket, ALeavingProcessIsReplacedByANewSession) {
  {
    Played process(path_);
    process.Receive();
    process.Send(EncodeBare(LinkKind::opened));
    lines_.WaitFor("accepts samples");
    EXPECT_EQ(link_->writer()->session(), 1U);
  }
  EXPECT_EQ(lines_.WaitFor("the process "), "the process closed the link");
  EXPECT_EQ(link_->writer()->session(), 0U);
  Played process(path_);
  process.Receive();
  process.Send(EncodeBare(LinkKind::opened));
  lines_.WaitFor("accepts samples");
  EXPECT_EQ(link_->writer()->session(), 2U);
}

TEST_F(ProcessLinkAtASocket, ASecondGatewayDoesNotTakeTheSocketAway) {
  ProcessLinkOptions options;
  options.socket = path_;
  const auto second = ProcessLink::Create(options, {});
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error(), HasSubstr("another process answers"));
}

}  // namespace
}  // namespace baudgate::dds
