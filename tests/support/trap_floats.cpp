// Preloaded into a test: the first division by zero or overflow of a float ends it with SIGFPE, and with
// TACTUS_TRAP_INVALID set the first invalid operation, too (comparing a NaN is one, so not where tests send
// some). Threads inherit it. Kernels compute lanes that nobody asks for, so it is for the code around them.
#include <cfenv>
#include <cstdlib>

namespace {
__attribute__((constructor)) void trap() {
  ::feenableexcept(FE_DIVBYZERO | FE_OVERFLOW |
                   (std::getenv("TACTUS_TRAP_INVALID") != nullptr ? FE_INVALID : 0));
}
}  // namespace
