#pragma once
#include <string>

namespace tactus {
/// The commit the program was configured from.
std::string commit_text();
/// "0.1.0"
std::string version_number();
/// "tactus 0.1.0 (commit, CUDA ...)"
std::string version_text();
/// Processor and, when one is used, GPU: for result files.
std::string machine_text();
}  // namespace tactus
