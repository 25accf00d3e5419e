#pragma once
/// The benchmark of tracked blades. Not in the benchmarks of GPU hosts: the noise on its masks is made with
/// OpenCV.
namespace tactus {

/// To those of tactus-bench, as "blade".
void add_blade_benchmark();

}  // namespace tactus
