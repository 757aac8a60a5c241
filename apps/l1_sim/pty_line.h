// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "host_line.h"

namespace ignis {

/// The sensor's end of a pseudo-terminal. Its other end appears under a name of our choice, as a serial port would.
class PtyLine final : public HostLine {
 public:
  /// Makes the pair and links `link` to the reader's end. A symbolic link of that name is replaced; anything else is an
  /// error. Throws runtime::UserError that says what to do.
  explicit PtyLine(std::filesystem::path link);
  ~PtyLine() override;

  /// True while somebody has the other end open.
  [[nodiscard]] bool has_reader() const override;

  /// When the reader does not keep up, waits up to 200 ms, then gives the rest up.
  bool write(std::span<const std::byte> bytes) override;

  [[nodiscard]] std::size_t read(std::span<std::byte> buffer, Clock::time_point deadline) override;

 private:
  std::filesystem::path link_;
  int master_ = -1;
};

}  // namespace ignis
