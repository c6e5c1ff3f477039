// `SteadyVector` is a list that grows while other threads read it. Its elements never move and are
// never removed. One thread at a time is allowed to append; other threads can read every element
// below size(). A reload uses it to add lines and devices while the others run.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <utility>

namespace baudgate {

template <typename T>
class SteadyVector {
 public:
  std::size_t size() const { return size_.load(std::memory_order_acquire); }
  T& operator[](std::size_t index) const {
    const std::size_t chunk = ChunkOf(index);
    return *chunks_[chunk][index - FirstOf(chunk)];
  }

  template <typename... Arguments>
  T& Append(Arguments&&... arguments) {
    const std::size_t index = size_.load(std::memory_order_relaxed);
    const std::size_t chunk = ChunkOf(index);
    if (!chunks_[chunk]) chunks_[chunk] = std::make_unique<Element[]>(kFirst << chunk);
    Element& element = chunks_[chunk][index - FirstOf(chunk)];
    element = std::make_unique<T>(std::forward<Arguments>(arguments)...);
    size_.store(index + 1, std::memory_order_release);
    return *element;
  }

 private:
  using Element = std::unique_ptr<T>;
  // Each chunk is twice as long as the chunk before: 16, 32, 64 …
  static constexpr std::size_t kFirst = 16;
  static std::size_t ChunkOf(std::size_t index) {
    return static_cast<std::size_t>(std::bit_width(index / kFirst + 1)) - 1;
  }
  static std::size_t FirstOf(std::size_t chunk) { return kFirst * ((std::size_t{1} << chunk) - 1); }

  std::array<std::unique_ptr<Element[]>, 32> chunks_;
  std::atomic<std::size_t> size_ = 0;
};

}  // namespace baudgate
