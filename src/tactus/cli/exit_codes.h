#pragma once
/// Every exit code of the program: the help, the man page and docs/results.md name them all.
#include <string>

namespace tactus {

inline constexpr int kExitFailed = 1, kExitUsage = 2, kExitBlewUp = 3, kExitDamaged = 6,
                     kExitInterrupted = 130;

struct ExitCode {
  int code;
  const char* meaning;
};
inline constexpr ExitCode kExitCodes[] = {
    {0, "done"},
    {kExitFailed, "failed: the message says why; nothing half-written stays"},
    {kExitUsage, "wrong usage: a flag, a verb or a key of a scene; nothing was begun"},
    {kExitBlewUp, "run: all results are written, but a body blew up and rested from then on"},
    {4, "doctor: the rig is faulty"},
    {5, "doctor: unsure whether the rig is right"},
    {kExitDamaged, "all results are written, but parts of the recording were damaged or cut off"},
    {kExitInterrupted, "interrupted (SIGINT, SIGTERM, SIGHUP): the results so far are written"},
};

/// "0 done, 1 failed: ...": a line each.
inline std::string exit_codes_text() {
  std::string text;
  for (const ExitCode& e : kExitCodes) text += "\n  " + std::to_string(e.code) + "  " + e.meaning;
  return text;
}

}  // namespace tactus
