// SPDX-License-Identifier: Apache-2.0
#include "runtime/stop_signal.h"

#include <csignal>

namespace ignis::runtime {
namespace {

// A signal handler can reach nothing but a global of this type.
volatile std::sig_atomic_t stop_flag = 0;

void raise_flag(int) { stop_flag = 1; }

}  // namespace

void catch_stop_signals() {
  struct sigaction action = {};
  action.sa_handler = raise_flag;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

bool stop_requested() { return stop_flag != 0; }

}  // namespace ignis::runtime
