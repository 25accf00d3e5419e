// One program a family: libFuzzer's inputs go to its readers. tools/fuzz.sh builds and runs them.
#include <cstddef>
#include <cstdint>

#include "fuzz/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tactus::fuzz::Family family = tactus::fuzz::family_of(TACTUS_FUZZ_FAMILY);
  tactus::fuzz::read_input(family, std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
