#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/tled/tled_kernels.h"

namespace tactus::tled {
template <class Law>
struct KernelsOf {
  using StoreOnCpu = ElementForces<OnePointCube<Law>, TilesOnCpu, StoreForces>;
  using StoreOnGpu = ElementForces<OnePointCube<Law>, TilesOnGpu, StoreForces>;
  using MoveOnCpu = ElementForces<OnePointCube<Law>, TilesOnCpu, MoveNodes>;
  using MoveOnGpu = ElementForces<OnePointCube<Law>, TilesOnGpu, MoveNodes>;
  using StoreFullOnCpu = ElementForces<EightPointCube<Law>, TilesOnCpu, StoreForces>;
  using StoreFullOnGpu = ElementForces<EightPointCube<Law>, TilesOnGpu, StoreForces>;
  using MoveFullOnCpu = ElementForces<EightPointCube<Law>, TilesOnCpu, MoveNodes>;
  using MoveFullOnGpu = ElementForces<EightPointCube<Law>, TilesOnGpu, MoveNodes>;
  using StoreRelaxingOnCpu = ElementForces<RelaxingCube<Law>, TilesOnCpu, StoreForces>;
  using StoreRelaxingOnGpu = ElementForces<RelaxingCube<Law>, TilesOnGpu, StoreForces>;
  using MoveRelaxingOnCpu = ElementForces<RelaxingCube<Law>, TilesOnCpu, MoveNodes>;
  using MoveRelaxingOnGpu = ElementForces<RelaxingCube<Law>, TilesOnGpu, MoveNodes>;
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
