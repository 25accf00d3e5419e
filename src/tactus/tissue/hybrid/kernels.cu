#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/hybrid/hybrid_kernels.h"

TACTUS_CUDA_KERNEL(tactus::hybrid::Integrate);
TACTUS_CUDA_KERNEL(tactus::hybrid::TakeOwned);
