// Preloaded into a program: the first division by zero or overflow of a float ends it with SIGFPE, and with
// TACTUS_TRAP_INVALID set the first invalid operation, too (comparing a NaN is one, so not where tests send
// some). Threads inherit it.
//
// Kernels compute lanes that nobody asks for, so whole runs are looked at with TACTUS_TRAP_REPORT: a line for
// each instruction that trapped, with those who called it, and the run goes on. The instruction is executed
// once more without traps, alone (the processor's trap flag), then the thread traps again.
#include <dlfcn.h>
#include <execinfo.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cfenv>
#include <csignal>
#include <cstdio>
#include <cstdlib>

namespace {

constexpr unsigned kMasks = 0x1f80, kFlags = 0x3f;  // of MXCSR
constexpr long long kTrapFlag = 0x100;              // of EFLAGS
constexpr std::size_t kMostSites = 1024, kMostCallers = 24;

unsigned trapped() {
  // A trapped exception has its mask bit clear: FE_* << 7.
  const unsigned wanted =
      FE_DIVBYZERO | FE_OVERFLOW | (std::getenv("TACTUS_TRAP_INVALID") != nullptr ? FE_INVALID : 0);
  return kMasks & ~(wanted << 7);
}

std::array<std::atomic<void*>, kMostSites> sites;

bool is_new(void* site) {
  for (std::atomic<void*>& known : sites) {
    void* none = nullptr;
    if (known.compare_exchange_strong(none, site)) return true;
    if (none == site) return false;
  }
  return false;
}

void report(void* site, const char* word) {
  Dl_info of{};
  ::dladdr(site, &of);
  char text[512];
  const int n =
      std::snprintf(text, sizeof text, "trap: %s %s +0x%lx\n", word, of.dli_fname ? of.dli_fname : "?",
                    static_cast<unsigned long>(static_cast<char*>(site) - static_cast<char*>(of.dli_fbase)));
  if (::write(STDERR_FILENO, text, static_cast<std::size_t>(n)) < 0) std::abort();
}

void on_trap(int, siginfo_t*, void* context) {
  auto& machine = static_cast<ucontext_t*>(context)->uc_mcontext;
  void* const site = reinterpret_cast<void*>(machine.gregs[REG_RIP]);
  if (is_new(site)) {
    report(site, "at");
    std::array<void*, kMostCallers> callers{};
    const int count = ::backtrace(callers.data(), kMostCallers);
    for (int i = 3; i < count; ++i) report(callers[static_cast<std::size_t>(i)], "from");
  }
  machine.fpregs->mxcsr = (machine.fpregs->mxcsr | kMasks) & ~kFlags;
  machine.gregs[REG_EFL] |= kTrapFlag;
}

void on_step(int, siginfo_t*, void* context) {
  auto& machine = static_cast<ucontext_t*>(context)->uc_mcontext;
  machine.fpregs->mxcsr = (machine.fpregs->mxcsr & ~(kMasks | kFlags)) | trapped();
  machine.gregs[REG_EFL] &= ~kTrapFlag;
}

__attribute__((constructor)) void trap() {
  if (std::getenv("TACTUS_TRAP_REPORT") != nullptr) {
    void* first = nullptr;
    ::backtrace(&first, 1);  // loads what it needs, outside of a handler
    struct sigaction action {};
    action.sa_flags = SA_SIGINFO;
    action.sa_sigaction = on_trap;
    ::sigaction(SIGFPE, &action, nullptr);
    action.sa_sigaction = on_step;
    ::sigaction(SIGTRAP, &action, nullptr);
  }
  ::feenableexcept(FE_DIVBYZERO | FE_OVERFLOW |
                   (std::getenv("TACTUS_TRAP_INVALID") != nullptr ? FE_INVALID : 0));
}

}  // namespace
