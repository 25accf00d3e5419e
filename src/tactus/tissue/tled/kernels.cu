#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/tled/tled_kernels.h"

namespace tactus::tled {
template <class Law>
struct KernelsOf {
  using StoreOnCpu = ElementForces<OnePointCube<Law>, kGroupsOnCpu, StoreForces>;
  using StoreOnGpu = ElementForces<OnePointCube<Law>, kGroupsOnGpu, StoreForces>;
  using MoveOnCpu = ElementForces<OnePointCube<Law>, kGroupsOnCpu, MoveNodes>;
  using MoveOnGpu = ElementForces<OnePointCube<Law>, kGroupsOnGpu, MoveNodes>;
  using StoreFullOnCpu = ElementForces<EightPointCube<Law>, kGroupsOnCpu, StoreForces>;
  using StoreFullOnGpu = ElementForces<EightPointCube<Law>, kGroupsOnGpu, StoreForces>;
  using MoveFullOnCpu = ElementForces<EightPointCube<Law>, kGroupsOnCpu, MoveNodes>;
  using MoveFullOnGpu = ElementForces<EightPointCube<Law>, kGroupsOnGpu, MoveNodes>;
};
}  // namespace tactus::tled

#define TACTUS_MATERIAL_LAW(LAW)                                      \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::StoreOnCpu);      \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::StoreOnGpu);      \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::MoveOnCpu);       \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::MoveOnGpu);       \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::StoreFullOnCpu);  \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::StoreFullOnGpu);  \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::MoveFullOnCpu);   \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<LAW>::MoveFullOnGpu)

TACTUS_CUDA_KERNEL(tactus::tled::LoadNodes);
TACTUS_MATERIAL_LAW(tactus::NeoHookean);
TACTUS_MATERIAL_LAW(tactus::IsochoricNeoHookean);
TACTUS_MATERIAL_LAW(tactus::TransverselyIsotropic);
TACTUS_CUDA_KERNEL(tactus::tled::FindExtremes);
