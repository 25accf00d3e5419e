#include "tactus/base/free_memory.h"

#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

namespace tactus {

double free_memory_bytes() {
  std::ifstream meminfo("/proc/meminfo");
  for (std::string line; std::getline(meminfo, line);) {
    double kib = 0;
    if (std::sscanf(line.c_str(), "MemAvailable: %lf kB", &kib) == 1) return 1024 * kib;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace tactus
