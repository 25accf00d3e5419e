#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/contact/pairs/pair_bound_kernels.h"
#include "tactus/contact/pairs/pair_cut_kernels.h"
#include "tactus/contact/pairs/pair_find_kernels.h"
#include "tactus/contact/pairs/pair_response_kernels.h"

TACTUS_CUDA_KERNEL(tactus::BoundPatches);
TACTUS_CUDA_KERNEL(tactus::BoundBodies);
TACTUS_CUDA_KERNEL(tactus::BoundCubes);
TACTUS_CUDA_KERNEL(tactus::FindPairs);
TACTUS_CUDA_KERNEL(tactus::PairImpulses);
TACTUS_CUDA_KERNEL(tactus::SetSolidCubes);
TACTUS_CUDA_KERNEL(tactus::SetPairPoints);
TACTUS_CUDA_KERNEL(tactus::WeighPairs);
TACTUS_CUDA_KERNEL(tactus::PlaceCubes);
TACTUS_CUDA_KERNEL(tactus::StartPatches);
TACTUS_CUDA_KERNEL(tactus::MovePairs);
