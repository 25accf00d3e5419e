#pragma once
/// Which law of contact the real surface follows.
#include <cstdint>

namespace tactus {

/// By exact distances (find_kernels.h), or as [P 16-25] (paper_kernels.h), which knows no obstacles.
/// The tests `ContactAtRest` compare the two.
enum class ContactResponse : std::uint8_t { exact, paper };

}  // namespace tactus
