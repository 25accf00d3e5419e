#pragma once
/// The frame of every program of Tactus around its verbs: flags that all share, interrupts, exit codes.
#include <functional>
#include <string>

#include "tactus/cli/commands.h"

namespace tactus {

/// Adds verbs with `set_up`, gives each `--verbose` and `--quiet`, parses and runs; an exception becomes one
/// line on standard error.
/// @returns the exit code (exit_codes.h).
int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& set_up);

/// For a verb whose result is an exit code: the value that run_program returns when nothing is thrown.
void set_exit_code(int code);
/// Warns of a source that is damaged or cut off, and ends the program with kExitDamaged; "" is well.
void note_damage(const std::string& damage);

}  // namespace tactus
