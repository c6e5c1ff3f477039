// Starts baudgate-dds beside us, with its end of the link as descriptor 3, and sees it end.
// BoundedLines makes log lines of what the process prints.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

// Text of another process as whole lines that may go into our log: printable, cut, and not more
// than a log can bear. Bytes come from its standard error.
class BoundedLines {
 public:
  static constexpr std::size_t kLongest = 500;  ///< bytes; the rest of a longer line is left out
  static constexpr std::size_t kMost = 20;  ///< lines in kPeriod; of the others the number is told
  static constexpr Duration kPeriod = 10s;

  /// The lines that are complete now.
  std::vector<std::string> Add(std::string_view bytes, Instant now);

 private:
  void Finish(Instant now, std::vector<std::string>& lines);

  std::string line_;
  Instant period_end_{};
  std::size_t told_ = 0;
  std::size_t left_out_ = 0;
};

/// Which descriptor of the child is its end of the link.
inline constexpr int kLinkDescriptor = 3;

class ChildProcess {
 public:
  /// Runs `program` with nothing of ours but the link and a pipe as its standard output and error,
  /// in a process group of its own: Ctrl-C is for us. The calling thread must outlive the child,
  /// which asks to die with it.
  static Result<ChildProcess> Start(const std::string& program,
                                    const std::vector<std::string>& arguments,
                                    const Descriptor& link);
  ~ChildProcess();  ///< kills what still runs
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  pid_t id() const { return id_; }
  /// What it writes to standard output and error; non-blocking.
  int output() const { return output_.get(); }
  void CloseOutput() { output_.Close(); }
  /// Waits for its end; kills it when the time is over. "was ended by signal 6", "left with exit
  /// code 1".
  std::string Reap(Duration most);

 private:
  ChildProcess() = default;

  pid_t id_ = -1;
  Descriptor output_;
};

/// Where `name` is: beside our own binary, or where programs are installed. The error says where
/// it was looked for.
Result<std::string> FindProgram(const std::string& name);

}  // namespace baudgate::dds
