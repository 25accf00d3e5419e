#pragma once
#include <cstddef>
#include <cstdint>

namespace tactus {

/// A place in a container of the standard library, which counts without signs; `Index` has one.
constexpr std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

}  // namespace tactus
