#pragma once
/// Vertex normals of a mesh on the device. Face normals are added as integers, so the sums have the same bits
/// in any order; three fields of 21 bits share one 64-bit word.
#include "tactus/base/vec.h"
#include "tactus/compute/atomic.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Sums of small vectors. A component is held in steps of 1/kSteps; each summand is cut to +-4 and 32 of
/// those fit.
struct PackedVector {
  static constexpr float kSteps = 8192;
  static constexpr int kBits = 21;

  TACTUS_HD static std::uint64_t pack(Vec3f v) {
    const auto field = [](float x) {
      return static_cast<std::uint64_t>(
          static_cast<std::int64_t>(floor_to_int(clamp(x, -4.F, 4.F) * kSteps + 0.5F)));
    };
    return field(v.x) + (field(v.y) << kBits) + (field(v.z) << (2 * kBits));
  }
  TACTUS_HD static Vec3f unpack(std::uint64_t packed) {
    const std::int64_t x = low_field(packed);
    packed = (packed - static_cast<std::uint64_t>(x)) >> kBits;
    const std::int64_t y = low_field(packed);
    packed = (packed - static_cast<std::uint64_t>(y)) >> kBits;
    const std::int64_t z = low_field(packed);
    return (1.F / kSteps) * Vec3f{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }

 private:
  TACTUS_HD static std::int64_t low_field(std::uint64_t packed) {
    return static_cast<std::int64_t>(packed << (64 - kBits)) >> (64 - kBits);
  }
};

/// Adds each triangle's area vector to its corners.
struct AddFaceNormals {
  static constexpr int kGrain = 512;
  View<const Vec3f> positions_m;
  View<const Vec3i> triangles;
  float inverse_unit_m2;  ///< area vectors are sums of vectors of about this length
  View<std::uint64_t> sums;
  TACTUS_HD void operator()(Index i) const {
    const Vec3i t = triangles[i];
    const Vec3f a = positions_m[t.x], n = cross(positions_m[t.y] - a, positions_m[t.z] - a);
    const std::uint64_t packed = PackedVector::pack(inverse_unit_m2 * n);
    atomic_add(sums[t.x], packed);
    atomic_add(sums[t.y], packed);
    atomic_add(sums[t.z], packed);
  }
};

/// Adds the mean normal of each triangle's corners to all three: a step of smoothing along the surface.
struct AddCornerNormals {
  static constexpr int kGrain = 512;
  View<const Vec3f> normals;
  View<const Vec3i> triangles;
  View<std::uint64_t> sums;
  TACTUS_HD void operator()(Index i) const {
    const Vec3i t = triangles[i];
    const std::uint64_t packed =
        PackedVector::pack((1.F / 3.F) * (normals[t.x] + normals[t.y] + normals[t.z]));
    atomic_add(sums[t.x], packed);
    atomic_add(sums[t.y], packed);
    atomic_add(sums[t.z], packed);
  }
};

struct NormalizeSums {
  static constexpr int kGrain = 1024;
  View<const std::uint64_t> sums;
  View<Vec3f> normals;
  TACTUS_HD void operator()(Index i) const {
    normals[i] = normalized(PackedVector::unpack(sums[i]), Vec3f{0, 1, 0});
  }
};

}  // namespace tactus
