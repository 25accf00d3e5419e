#pragma once
/// Memory of the computer.

namespace tactus {

/// That programs may still take, as the kernel says; where it doesn't, no end is known: infinite.
double free_memory_bytes();

}  // namespace tactus
