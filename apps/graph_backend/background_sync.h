// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <future>
#include <optional>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace ignis {

/// Brings a file to the disk in a second thread, one call at a time: a slow disk takes seconds for it.
class BackgroundSync {
 public:
  struct Outcome {
    std::size_t size = 0;  ///< of the file when it began
    int error = 0;         ///< an errno; 0: all of that is on the disk
  };

  /// The file of which `size` bytes are written. Not while one is under way.
  void begin(int file, std::size_t size) {
    began_ = std::chrono::steady_clock::now();
    wanted_ = true;
    // One of its own, so that the file may be closed meanwhile.
    const int own = fcntl(file, F_DUPFD_CLOEXEC, 0);
    if (own < 0) {
      outcome_ = ready({size, errno});
      return;
    }
    try {
      outcome_ = std::async(std::launch::async, [own, size] {
        const int error = fdatasync(own) == 0 ? 0 : errno;
        close(own);
        return Outcome{size, error};
      });
    } catch (const std::system_error& error) {  // there is no thread to be had
      close(own);
      outcome_ = ready({size, error.code().value()});
    }
  }

  /// What became of it, once. Nothing while it is under way, and of a file that was left.
  [[nodiscard]] std::optional<Outcome> finished() {
    if (!under_way() || outcome_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
    const Outcome outcome = outcome_.get();
    return std::exchange(wanted_, false) ? std::optional(outcome) : std::nullopt;
  }

  [[nodiscard]] bool under_way() const { return outcome_.valid(); }

  /// For how long the disk has not answered.
  [[nodiscard]] std::chrono::steady_clock::duration waits() const {
    return under_way() ? std::chrono::steady_clock::now() - began_ : std::chrono::steady_clock::duration{};
  }

  /// What is under way is of a file that is no longer written.
  void leave() { wanted_ = false; }

 private:
  [[nodiscard]] static std::future<Outcome> ready(Outcome outcome) {
    std::promise<Outcome> promise;
    promise.set_value(outcome);
    return promise.get_future();
  }

  std::future<Outcome> outcome_;  // waits in its destructor
  std::chrono::steady_clock::time_point began_{};
  bool wanted_ = false;
};

}  // namespace ignis
