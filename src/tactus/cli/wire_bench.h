#pragma once
/// The benchmark of live cameras. Not in tactus-bench, which runs where ZeroMQ is not.
#include "bench.h"

namespace tactus::bench {

Rows run_wire(const std::string& device_text);

}  // namespace tactus::bench
