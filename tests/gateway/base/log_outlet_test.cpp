// A log line never waits for its reader.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/log_outlet.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <string>

namespace baudgate::log {
namespace {

/// A pipe of the smallest size, whose reader reads when it is told to.
class StalledReader {
 public:
  StalledReader() {
    EXPECT_EQ(::pipe2(ends_, O_CLOEXEC), 0);
    capacity_ = static_cast<std::size_t>(::fcntl(ends_[1], F_SETPIPE_SZ, 4096));
  }
  ~StalledReader() {
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  int descriptor() const { return ends_[1]; }
  /// Until `text` has come.
  std::string ReadUntil(const std::string& text) {
    std::string all;
    char buffer[512];
    while (all.find(text) == std::string::npos) {
      const ssize_t count = ::read(ends_[0], buffer, sizeof buffer);
      if (count <= 0) break;
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }
  void CloseReader() {
    ::close(ends_[0]);
    ends_[0] = -1;
  }
  void Fill() const {
    const std::string filler(capacity_, '#');
    EXPECT_EQ(::write(ends_[1], filler.data(), filler.size()), static_cast<ssize_t>(capacity_));
  }

 private:
  int ends_[2] = {-1, -1};
  std::size_t capacity_ = 0;
};

TEST(Outlet, WritesAllInTheirOrder) {
  StalledReader reader;
  Outlet outlet(reader.descriptor());
  for (int n = 0; n < 100; ++n) outlet.Put("line " + std::to_string(n) + "\n");
  const std::string all = reader.ReadUntil("line 99\n");
  std::string expected;
  for (int n = 0; n < 100; ++n) expected += "line " + std::to_string(n) + "\n";
  EXPECT_EQ(all, expected);
  EXPECT_TRUE(outlet.Flush(10s));
  EXPECT_EQ(outlet.dropped(), 0u);
}

TEST(Outlet, DropsWhatFindsNoRoomAndTellsItsReaderHowMuch) {
  StalledReader reader;
  reader.Fill();
  Outlet outlet(reader.descriptor(), 10000);
  const std::string line(99, 'x');
  for (int n = 0; n < 1000; ++n) outlet.Put(line + "\n");
  // The queue is full, and one line may be on its way.
  EXPECT_GE(outlet.dropped(), 1000u - 100u - 1u);
  EXPECT_FALSE(outlet.Flush(0s));
  outlet.Put(std::string(250, 'y') + "\n");  // dropped, too
  const std::string text = std::to_string(outlet.dropped()) + " lines of the log were dropped here";
  const std::string all = reader.ReadUntil("nobody read it\n");
  EXPECT_NE(all.find(text), std::string::npos) << all.substr(all.size() - 200);
  EXPECT_EQ(all.find("yy"), std::string::npos);
  // Nothing is told twice.
  outlet.Put("later\n");
  EXPECT_EQ(reader.ReadUntil("later\n"), "later\n");
}

TEST(Outlet, EndsAlthoughItsReaderHoldsTheThread) {
  StalledReader reader;
  {
    Outlet outlet(reader.descriptor(), 1000000);
    outlet.Put(std::string(100000, 'x') + "\n");
    EXPECT_FALSE(outlet.Flush(1ms));
  }
  // The thread is still writing, to a pipe that ends here.
  EXPECT_EQ(reader.ReadUntil("\n").size(), 100001u);
}

TEST(Outlet, AReaderThatIsGoneHoldsNothing) {
  signal(SIGPIPE, SIG_IGN);
  StalledReader reader;
  Outlet outlet(reader.descriptor());
  reader.CloseReader();
  outlet.Put("line\n");
  EXPECT_TRUE(outlet.Flush(10s));
  EXPECT_EQ(outlet.dropped(), 1u);
}

}  // namespace
}  // namespace baudgate::log
