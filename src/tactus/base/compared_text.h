#pragma once
/// Numbers in messages that give a value beyond its limit, and the limit.
#include <string>

namespace tactus {

/// As number_text, with as many digits as tell x from the limit that stands beside it: "0.2004" and "0.2",
/// "0.20000000298023224" and "0.2".
std::string number_text(double x, double limit);
/// As bytes_text, or all bytes where that reads like the limit.
std::string bytes_text(double bytes, double limit);

}  // namespace tactus
