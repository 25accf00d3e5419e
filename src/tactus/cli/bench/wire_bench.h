#pragma once
/// The benchmark of live cameras. Not in the benchmarks of GPU hosts, which run where ZeroMQ is not.
namespace tactus {

/// To those of tactus-bench, as "wire".
void add_wire_benchmark();

}  // namespace tactus
