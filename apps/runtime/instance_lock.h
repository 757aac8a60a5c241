// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace ignis::runtime {

/// Lets a process be alone of its kind on a bus: two drivers or two front ends that publish at once are one stream of
/// nonsense. The lock is a name that the kernel gives to one socket of a network namespace at a time, and takes back
/// the moment its owner is gone, however it ended; no file stays behind. It does not reach other computers: those are
/// told apart by PeerWatch.
class InstanceLock {
 public:
  /// Throws UserError (code 1) when another `process` of this computer is on the bus of `url`. Buses that are no UDP
  /// multicast, such as memq, are not shared and need no lock.
  InstanceLock(const std::string& process, const std::string& url);
  ~InstanceLock();
  InstanceLock(const InstanceLock&) = delete;
  InstanceLock& operator=(const InstanceLock&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace ignis::runtime
