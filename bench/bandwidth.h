#pragma once
/// What a device's memory delivers: floors are stated with it.
#include "tactus/compute/exec_context.h"

namespace tactus::bench {

/// Bytes read plus bytes written per second, the better of a copy and of a loop over all cores, 256 MB each
/// way: one core alone doesn't fill a processor's memory channels.
double measure_bandwidth_B_s(ExecContext& ctx);

}  // namespace tactus::bench
