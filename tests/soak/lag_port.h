// `LagPort` is the device side of a real pty: it finds the requests in the bytes of a master, and
// writes the replies when they are due. It runs in the thread of the io_context.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/steady_timer.hpp>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/tools/simulate/pty.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "protocols/assembler.h"
#include "protocols/protocol.h"

namespace baudgate {

class LagPort {
 public:
  using OnRequest =
      std::function<std::vector<tools::TimedPiece>(View request, Instant end_of_request)>;

  /// `path` is a link to the pty. `io` and `protocol` must outlive this object, which must end
  /// after the last run of `io`.
  LagPort(asio::io_context& io, const protocols::Protocol& protocol, const config::Options& options,
          const tools::TwinWire& wire, const std::string& path, OnRequest on_request);

  std::string Latest() const;

 private:
  struct Passed {
    Instant at;
    bool is_request = false;
    Bytes bytes;
  };

  void Read();
  void Take(View bytes);
  std::optional<Bytes> NextRequest();
  void SendNext();
  void Keep(bool is_request, View bytes);

  tools::TwinWire wire_;
  tools::Pty pty_;
  asio::posix::stream_descriptor descriptor_;
  asio::steady_timer timer_;
  OnRequest on_request_;
  protocols::Assembler assembler_;
  std::array<std::uint8_t, 1024> buffer_{};
  std::multimap<Instant, Bytes> leaving_;
  std::deque<Passed> passed_;
};

}  // namespace baudgate
