#pragma once
/// `tactus calibrate tof`.
#include <CLI/CLI.hpp>

namespace tactus {
void add_calibrate_tof(CLI::App& calibrate);
}
