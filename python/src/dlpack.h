#pragma once
/// The memory layout of DLPack's capsules, versions 0.8 and 1.0 (https://dmlc.github.io/dlpack): libraries
/// hand arrays to one another by it.
#include <cstdint>

namespace tactus::python::dlpack {

inline constexpr std::int32_t kCpu = 1, kCuda = 2;  ///< kinds of device
inline constexpr std::uint8_t kInt = 0, kFloat = 2;
inline constexpr std::uint64_t kReadOnly = 1;

struct Device {
  std::int32_t kind, ordinal;
};
struct DataType {
  std::uint8_t code, bits;
  std::uint16_t lanes;
};
struct Tensor {
  void* data;
  Device device;
  std::int32_t dimensions;
  DataType type;
  std::int64_t* shape;
  std::int64_t* strides;  ///< in elements
  std::uint64_t byte_offset;
};
/// In a capsule "dltensor"; whoever takes it renames it, and calls the deleter at the end.
struct Managed {
  static constexpr const char* kName = "dltensor";
  Tensor tensor;
  void* context;
  void (*deleter)(Managed*);
};
/// In a capsule "dltensor_versioned", for those who ask for version 1 or later.
struct ManagedVersioned {
  static constexpr const char* kName = "dltensor_versioned";
  std::uint32_t major, minor;
  void* context;
  void (*deleter)(ManagedVersioned*);
  std::uint64_t flags;
  Tensor tensor;
};

}  // namespace tactus::python::dlpack
