#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/tled/tled_kernels.h"

TACTUS_CUDA_KERNEL(tactus::tled::LoadNodes);
TACTUS_CUDA_KERNEL(tactus::tled::ElementForces<tactus::tled::OnePointCube<tactus::NeoHookean>>);
TACTUS_CUDA_KERNEL(tactus::tled::ElementForces<tactus::tled::EightPointCube<tactus::NeoHookean>>);
TACTUS_CUDA_KERNEL(tactus::tled::ElementForces<tactus::tled::OnePointCube<tactus::IsochoricNeoHookean>>);
TACTUS_CUDA_KERNEL(tactus::tled::ElementForces<tactus::tled::EightPointCube<tactus::IsochoricNeoHookean>>);
TACTUS_CUDA_KERNEL(tactus::tled::ElementForces<tactus::tled::OnePointCube<tactus::TransverselyIsotropic>>);
TACTUS_CUDA_KERNEL(tactus::tled::ElementForces<tactus::tled::EightPointCube<tactus::TransverselyIsotropic>>);
TACTUS_CUDA_KERNEL(tactus::tled::Integrate);
TACTUS_CUDA_KERNEL(tactus::tled::FindExtremes);
