// Something done on the thread of a loop, for a thread that waits for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <future>
#include <memory>

namespace baudgate {

/// The loop runs, and this is not its thread.
template <typename Call>
void RunOn(asio::io_context& io, Call call) {
  const auto done = std::make_shared<std::promise<void>>();
  asio::post(io, [done, &call] {
    call();
    done->set_value();
  });
  done->get_future().wait();
}

}  // namespace baudgate
