// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <span>

namespace ignis {

/// The sensor's end of a pseudo-terminal. Its other end appears under a name of our choice, as a serial port would.
class PtyLine {
 public:
  /// Makes the pair and links `link` to the reader's end. A symbolic link of that name is replaced; anything else is an
  /// error. Throws runtime::UserError that says what to do.
  explicit PtyLine(std::filesystem::path link);
  ~PtyLine();
  PtyLine(const PtyLine&) = delete;
  PtyLine& operator=(const PtyLine&) = delete;

  /// True while somebody has the other end open.
  [[nodiscard]] bool has_reader() const;

  /// Sends bytes; when the reader does not keep up, waits up to `patience`, then gives the rest up and returns false.
  bool write(std::span<const std::byte> bytes, std::chrono::milliseconds patience);

  /// Throws away what the host sent.
  void discard_input();

 private:
  std::filesystem::path link_;
  int master_ = -1;
};

}  // namespace ignis
