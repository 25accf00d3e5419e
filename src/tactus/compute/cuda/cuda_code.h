#pragma once
/// The code for GPUs that a build holds, and whether a GPU and its driver can run it. Pure, so that any
/// machine tests it.
#include <string>
#include <string_view>
#include <vector>

namespace tactus::cuda {

/// Compute capabilities are written as in the names of nvcc: 86 is 8.6.
struct BuildCode {
  std::vector<int> binaries;  ///< machine code
  std::vector<int> ptx;       ///< which a driver compiles for newer GPUs
};
/// @param architectures as CMake's CUDA_ARCHITECTURES: "90-real;75-virtual"; "80" is both
BuildCode parse_build_code(std::string_view architectures);

/// Where the code of a GPU comes from.
enum class CodeOrigin {
  binary,  ///< the build has it
  ptx,     ///< the driver compiles it at the first start and keeps it
  none,
};

struct GpuCode {
  CodeOrigin origin = CodeOrigin::none;
  std::string text;  ///< "code for 9.0", "PTX for 7.5, ...", or why there is none and a remedy
};
/// @param capability 86: 8.6
/// @param driver, runtime CUDA versions as the runtime reports them: 12040
/// Machine code runs on GPUs of its own major capability and the same or a higher minor one. PTX runs on
/// every newer GPU, where the driver is not older than the compiler (CUDA C++ Programming Guide, "Compute
/// capabilities"; CUDA Compatibility).
GpuCode code_for(const BuildCode& build, int capability, int driver, int runtime);

/// 12040 -> "12.4"
std::string version_text(int version);
/// 86 -> "8.6"
std::string capability_text(int capability);

}  // namespace tactus::cuda
