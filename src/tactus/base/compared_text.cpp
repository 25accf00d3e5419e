#include "tactus/base/compared_text.h"

#include <cstdio>

#include "tactus/base/error.h"

namespace tactus {

std::string number_text(double x, double limit) {
  const std::string other = number_text(limit);
  std::string text = number_text(x);
  for (int digits = 7; text == other && x != limit && digits <= 17; ++digits) {
    char longer[40];
    std::snprintf(longer, sizeof longer, "%.*g", digits, x);
    text = longer;
  }
  return text;
}

std::string bytes_text(double bytes, double limit) {
  std::string text = bytes_text(bytes);
  if (text != bytes_text(limit) || bytes == limit) return text;
  char all[40];
  std::snprintf(all, sizeof all, "%.0f B", bytes);
  return all;
}

}  // namespace tactus
