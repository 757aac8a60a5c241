// SPDX-License-Identifier: Apache-2.0
#include "fault_report.h"

#include <format>

#include "common/file_output.h"

namespace ignis {

std::string summary(const sim::ByteFaults& faults) {
  std::string injected;
  for (std::size_t i = 0; i < sim::kFaultCount; ++i) {
    const auto fault = static_cast<sim::Fault>(i);
    if (faults.count(fault) == 0) continue;
    injected += std::format("{}{} {}", injected.empty() ? "" : ", ", faults.count(fault), name_of(fault));
  }
  return std::format("{} frames; injected: {}", faults.frames(), injected.empty() ? "nothing" : injected);
}

void write_fault_list(const std::filesystem::path& file, const sim::ByteFaults& faults) {
  FileOutput output(file);
  output.stream() << "offset,frame,fault\n";
  for (const sim::InjectedFault& each : faults.injected()) {
    output.stream() << std::format("{},{},{}\n", each.offset, each.frame, name_of(each.fault));
  }
  output.commit();
}

}  // namespace ignis
