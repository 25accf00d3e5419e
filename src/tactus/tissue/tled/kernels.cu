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
  using StoreRelaxingOnCpu = ElementForces<RelaxingCube<Law>, kGroupsOnCpu, StoreForces>;
  using StoreRelaxingOnGpu = ElementForces<RelaxingCube<Law>, kGroupsOnGpu, StoreForces>;
  using MoveRelaxingOnCpu = ElementForces<RelaxingCube<Law>, kGroupsOnCpu, MoveNodes>;
  using MoveRelaxingOnGpu = ElementForces<RelaxingCube<Law>, kGroupsOnGpu, MoveNodes>;
};
}  // namespace tactus::tled

#define TACTUS_ROW(WORD, LAW)                                                   \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::StoreOnCpu);         \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::StoreOnGpu);         \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::MoveOnCpu);          \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::MoveOnGpu);          \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::StoreFullOnCpu);     \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::StoreFullOnGpu);     \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::MoveFullOnCpu);      \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::MoveFullOnGpu);      \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::StoreRelaxingOnCpu); \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::StoreRelaxingOnGpu); \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::MoveRelaxingOnCpu);  \
  TACTUS_CUDA_KERNEL(tactus::tled::KernelsOf<tactus::LAW>::MoveRelaxingOnGpu);

TACTUS_CUDA_KERNEL(tactus::tled::LoadPositions);
TACTUS_CUDA_KERNEL(tactus::tled::LoadNodes);
TACTUS_CUDA_KERNEL(tactus::tled::StoreNodes);
TACTUS_MATERIAL_LAWS(TACTUS_ROW)
TACTUS_CUDA_KERNEL(tactus::tled::FindExtremes);
