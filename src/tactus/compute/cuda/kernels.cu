#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/compute/sum_kernels.h"

TACTUS_CUDA_KERNEL(tactus::SumChunk);
