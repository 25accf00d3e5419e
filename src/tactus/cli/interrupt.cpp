#include "tactus/cli/interrupt.h"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <utility>

#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/exit_codes.h"

namespace tactus {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;
volatile std::sig_atomic_t first_signal = 0;
timespec first_time;

/// Ends by the signal itself, so a process that waits for the program sees the cause.
void end_by(int signal) {
  remove_temporary_files();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// coreutils' timeout signals the program, and at once its whole process group: that is one request.
bool repeats_first(int signal) {
  constexpr double kAtOnce_s = 0.02;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const double since_s = static_cast<double>(now.tv_sec - first_time.tv_sec) +
                         1e-9 * static_cast<double>(now.tv_nsec - first_time.tv_nsec);
  return signal == first_signal && since_s < kAtOnce_s;
}

/// Only calls that POSIX allows in a handler.
void on_signal(int signal) {
  if (interrupt_flag != 0) {
    if (!repeats_first(signal)) end_by(signal);
    return;
  }
  interrupt_flag = 1;
  first_signal = signal;
  clock_gettime(CLOCK_MONOTONIC, &first_time);
  constexpr char kText[] = "\ninterrupted: this frame and the files are finished; once more ends at once\n";
  // (A terminal that is gone can't be told.)
  if (log_level() != LogLevel::quiet && ::write(STDERR_FILENO, kText, sizeof kText - 1) < 0) return;
}

bool is_ignored(int signal) {
  struct sigaction now {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

}  // namespace

void install_interrupt_handler() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  // One handler at a time: a SIGTERM within the SIGINT's waits for it.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&action.sa_mask, signal);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  if (!is_ignored(SIGHUP)) sigaction(SIGHUP, &action, nullptr);  // under nohup the run goes on
  // A reader that went away (`tactus ... | head`) ends the program, as it does others, but nothing
  // half-written stays.
  if (!is_ignored(SIGPIPE)) std::signal(SIGPIPE, end_by);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit of file size is an error of the write that meets it
}
bool interrupted() { return interrupt_flag != 0; }

FramePatience::FramePatience(std::function<void()> give_up)
    : give_up_(std::move(give_up)), thread_([this] { watch(); }) {}

FramePatience::~FramePatience() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void FramePatience::begin() {
  const std::lock_guard lock(mutex_);
  works_ = true;
}
void FramePatience::end() {
  const std::lock_guard lock(mutex_);
  works_ = false;
}

void FramePatience::watch() {
  using namespace std::chrono_literals;
  std::unique_lock lock(mutex_);
  for (auto left = 1200ms; left > 0ms;) {
    if (changed_.wait_for(lock, 100ms, [this] { return is_over_; })) return;
    if (interrupted()) left -= 100ms;
  }
  // Between frames the work sees the signal itself.
  while (!works_)
    if (changed_.wait_for(lock, 100ms, [this] { return is_over_; })) return;
  try {
    give_up_();
    log_warning("this frame is given up; those before it are whole");
  } catch (const std::exception& error) {
    log_warning(error.what());
  }
  std::fflush(stdout);
  remove_temporary_files();
  std::_Exit(kExitInterrupted);
}

}  // namespace tactus
