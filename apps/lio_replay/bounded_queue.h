// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace ignis {

/// First in, first out, from one thread to another. (oneTBB's bounded queue would do, but hands memory on inside a
/// library that is not built with the thread sanitizer, which then finds races that are none.)
template <class Item>
class BoundedQueue {
 public:
  /// `capacity`: at least 1 is taken.
  explicit BoundedQueue(std::size_t capacity) : capacity_(std::max<std::size_t>(capacity, 1)) {}

  /// Waits while the queue is full. False when it is closed: then the item is gone.
  [[nodiscard]] bool push(Item item) {
    std::unique_lock lock(mutex_);
    has_room_.wait(lock, [this] { return closed_ || items_.size() < capacity_; });
    if (closed_) return false;
    items_.push_back(std::move(item));
    lock.unlock();
    has_items_.notify_one();
    return true;
  }

  /// Waits while the queue is empty. Nothing when it is closed as well.
  [[nodiscard]] std::optional<Item> pop() {
    std::unique_lock lock(mutex_);
    has_items_.wait(lock, [this] { return closed_ || !items_.empty(); });
    if (items_.empty()) return std::nullopt;
    std::optional<Item> item = std::move(items_.front());
    items_.pop_front();
    lock.unlock();
    has_room_.notify_one();
    return item;
  }

  /// From either end: nothing more comes in, what is in may be taken still. Needs no memory, so that it may be called
  /// where there is none.
  void close() noexcept {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    has_items_.notify_all();
    has_room_.notify_all();
  }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable has_room_;
  std::condition_variable has_items_;
  std::deque<Item> items_;
  bool closed_ = false;
};

}  // namespace ignis
