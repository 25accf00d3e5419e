#include "tactus/cli/interrupt.h"

#include <unistd.h>

#include <csignal>

#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

/// Only what POSIX allows in a handler.
void on_signal(int signal) {
  if (interrupt_flag == 0) {
    interrupt_flag = 1;
    constexpr char kText[] = "\ninterrupted: this frame and the files are finished; once more ends at once\n";
    if (log_level() != LogLevel::quiet && ::write(STDERR_FILENO, kText, sizeof kText - 1) < 0) return;
    return;
  }
  remove_temporary_files();
  std::signal(signal, SIG_DFL);  // whoever waits for the program sees what ended it
  std::raise(signal);
}

}  // namespace

void install_interrupt_handler() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  // One handler at a time: a SIGTERM within the SIGINT's waits for it.
  sigaddset(&action.sa_mask, SIGINT);
  sigaddset(&action.sa_mask, SIGTERM);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit of file size is an error of the write that meets it
}
bool interrupted() { return interrupt_flag != 0; }

}  // namespace tactus
