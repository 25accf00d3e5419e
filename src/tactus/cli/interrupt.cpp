#include "tactus/cli/interrupt.h"

#include <csignal>

namespace tactus {
namespace {
volatile std::sig_atomic_t interrupt_flag = 0;
}

void install_interrupt_handler() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupt_flag = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}
bool interrupted() { return interrupt_flag != 0; }

}  // namespace tactus
