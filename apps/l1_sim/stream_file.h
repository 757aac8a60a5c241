// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim/byte_faults.h"

namespace ignis {

/// A file that a simulated stream goes into.
class StreamFile {
 public:
  StreamFile() = default;
  virtual ~StreamFile() = default;
  StreamFile(const StreamFile&) = delete;
  StreamFile& operator=(const StreamFile&) = delete;

  virtual void add(const sim::Delivery& delivery) = 0;
  /// The true motion at an inertial sample; `utime` counts from the start of the stream.
  virtual void add_truth(Utime utime, const sim::Motion& motion) = 0;
  /// The stream has ended: the file appears.
  virtual void commit() = 0;
};

}  // namespace ignis
