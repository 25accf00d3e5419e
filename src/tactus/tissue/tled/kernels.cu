#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/tled/tled_kernels.h"

namespace tactus::tled {
template <class Law>
using OnePointOnCpu = ElementForces<OnePointCube<Law>, kGroupsOnCpu>;
template <class Law>
using OnePointOnGpu = ElementForces<OnePointCube<Law>, kGroupsOnGpu>;
template <class Law>
using EightPointOnCpu = ElementForces<EightPointCube<Law>, kGroupsOnCpu>;
template <class Law>
using EightPointOnGpu = ElementForces<EightPointCube<Law>, kGroupsOnGpu>;
}  // namespace tactus::tled

TACTUS_CUDA_KERNEL(tactus::tled::LoadNodes);
TACTUS_CUDA_KERNEL(tactus::tled::OnePointOnCpu<tactus::NeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::OnePointOnGpu<tactus::NeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::EightPointOnCpu<tactus::NeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::EightPointOnGpu<tactus::NeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::OnePointOnCpu<tactus::IsochoricNeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::OnePointOnGpu<tactus::IsochoricNeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::EightPointOnCpu<tactus::IsochoricNeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::EightPointOnGpu<tactus::IsochoricNeoHookean>);
TACTUS_CUDA_KERNEL(tactus::tled::OnePointOnCpu<tactus::TransverselyIsotropic>);
TACTUS_CUDA_KERNEL(tactus::tled::OnePointOnGpu<tactus::TransverselyIsotropic>);
TACTUS_CUDA_KERNEL(tactus::tled::EightPointOnCpu<tactus::TransverselyIsotropic>);
TACTUS_CUDA_KERNEL(tactus::tled::EightPointOnGpu<tactus::TransverselyIsotropic>);
TACTUS_CUDA_KERNEL(tactus::tled::Integrate);
TACTUS_CUDA_KERNEL(tactus::tled::FindExtremes);
