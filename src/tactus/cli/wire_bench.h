#pragma once
/// The benchmark of live cameras. Not in tactus-bench, which runs where ZeroMQ is not.
namespace tactus {

/// To those of `tactus bench`, as "wire".
void add_wire_benchmark();

}  // namespace tactus
