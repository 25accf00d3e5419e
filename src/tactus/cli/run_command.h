#pragma once
/// `tactus run SCENE.yaml`: the whole loop on a scene.
#include <CLI/CLI.hpp>

namespace tactus {
void add_run_command(CLI::App& app);
}  // namespace tactus
